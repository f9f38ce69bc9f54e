# A sweep as a Snakemake workflow: shards on any number of processors or nodes, then the merge.
#
#     snakemake -s scripts/sweep.smk --cores 8 --config sweep=SWEEP.json output=out/sweep.h5 shards=8
#
# A shard that was killed goes on where it stopped when the same command is given again. tpm is taken from the
# path, or from `--config tpm=build/release/tpm`.
SWEEP = config["sweep"]
OUTPUT = config["output"]
SHARDS = int(config.get("shards", 4))
TPM = config.get("tpm", "tpm")


rule merge:
    input:
        expand(OUTPUT + ".shard-{task}-of-{shards}.done", task=range(1, SHARDS + 1), shards=[SHARDS]),
        sweep=SWEEP,
    output:
        OUTPUT,
    shell:
        "{TPM} sweep merge {input.sweep:q} -o {output:q}"


# The shard itself is no output of its rule: Snakemake would remove the file of a job that failed, and with it what
# the job had done.
rule shard:
    input:
        SWEEP,
    output:
        touch(OUTPUT + ".shard-{task}-of-{shards}.done"),
    threads: 1
    resources:
        mem_mb=4000,
    shell:
        "{TPM} sweep {input:q} -o " + OUTPUT + " --workers {threads} --shard {wildcards.task}/{wildcards.shards}"
