"""Writes a force curve as the software of a JPK instrument stores it, with Python's own zipfile: the importer
is tested against it (test_import_jpk.cpp). All numbers are synthetic.

    write_jpk.py OUT VARIANT             three segments of a few samples, see `small`
    write_jpk.py OUT VARIANT CURVE.csv   time (s), depth (m) and force (N) of a file, as one extend segment and one pause

VARIANT: shared (format 2.0: integers, deflated, blocks in shared-data), plain (format 0.12: shorts, stored, all
in the segment), float (IEEE numbers), uncalibrated (no spring constant)."""
import struct
import sys
import zipfile

SPRING, SENSITIVITY, BASELINE = 0.05, 1e-7, -0.25  # N/m, m/V, V


def small():
    """(kind, control, duration in s, heights in m, deflections in V). Contact is at sample 3; from there the
    deflection rises by 0.5 V a sample, falls by a quarter of a volt in the pause, and is 0 in the retract."""
    volts = lambda n: BASELINE + 0.5 * n
    return [
        ("extend", "z-extend-force", 0.8, [20e-6 - 1e-6 * i for i in range(8)], [volts(max(0, i - 3)) for i in range(8)]),
        ("pause", "constant-height-pause", 2.0, [13e-6] * 4, [volts(4 - 0.5 * i) for i in range(4)]),
        ("retract", "z-retract-height", 0.4, [15e-6, 17e-6, 19e-6, 21e-6], [volts(0)] * 4),
    ]


def from_csv(file):
    """The tip's depth and force become a height and a deflection; where the depth stands, the pause begins."""
    rows = [[float(x) for x in line.split(",")] for line in open(file) if line[0] in "0123456789-"]
    step = rows[1][0] - rows[0][0]
    deepest = max(row[1] for row in rows)
    cut = next(i for i, row in enumerate(rows) if row[1] > 0.999999 * deepest)
    volts = [BASELINE + row[2] / SPRING / SENSITIVITY for row in rows]
    heights = [50e-6 - row[1] - row[2] / SPRING for row in rows]
    return [("extend", "z-extend-force", cut * step, heights[:cut], volts[:cut]),
            ("pause", "constant-height-pause", (len(rows) - cut) * step, heights[cut:], volts[cut:])]


def conversions(channel, slots):
    """The block of a channel's conversions: (slot, base slot, offset, multiplier, unit)."""
    lines = ["conversion-set.conversions.list=" + " ".join(s[0] for s in slots),
             "conversion-set.conversions.default=" + slots[-1][0], "conversion-set.conversions.base=volts",
             "conversion-set.conversion.volts.name=Volts", "conversion-set.conversion.volts.defined=false"]
    for slot, base, offset, multiplier, unit in slots:
        at = f"conversion-set.conversion.{slot}."
        lines += [at + "defined=true", at + f"base-calibration-slot={base}", at + "scaling.type=linear",
                  at + "scaling.style=offsetmultiplier", at + f"scaling.offset={offset!r}",
                  at + f"scaling.multiplier={multiplier!r}", at + "scaling.unit.type=metric-unit",
                  at + f"scaling.unit.unit={unit}"]
    return lines


# Heights are stored as volts that rise while the cantilever falls: z = 0.5 (1e-4 m - 1e-6 m/V volts).
HEIGHT = [("nominal", "volts", 1e-4, -1e-6, "m"), ("calibrated", "nominal", 0.0, 0.5, "m")]
DEFLECTION = [("distance", "volts", 0.0, SENSITIVITY, "m"), ("force", "distance", 0.0, SPRING, "N")]


def encoder(offset, multiplier, word):
    return [f"encoder.type={word}", "encoder.scaling.type=linear", "encoder.scaling.style=offsetmultiplier",
            f"encoder.scaling.offset={offset!r}", f"encoder.scaling.multiplier={multiplier!r}",
            "encoder.scaling.unit.unit=V"]


def write(out, variant, segments, fine):
    word, letter = {"plain": ("signedshort", "h"), "float": (None, "f")}.get(variant, ("signedinteger", "i"))
    deflection = DEFLECTION[:1] if variant == "uncalibrated" else DEFLECTION
    # (name, volts of a segment, conversions, offset and multiplier of the encoder)
    channels = [("height", lambda z, v: [(1e-4 - 2 * x) / 1e-6 for x in z], HEIGHT, 50.0, 1e-7 if fine else 0.5),
                ("vDeflection", lambda z, v: v, deflection, 0.125, 1e-8 if fine else 2.0**-10)]
    files = {"header.properties": ["#Thu Jan 01 00\\:00\\:00 UTC 2026", "jpk-data-file=spm-forcefile",
                                   "file-format-version=" + ("0.12" if variant == "plain" else "2.0"),
                                   "type=force-scan-series", "force-scan-series.description.comment=a \\",
                                   "    comment on two lines \\u00b5"]}
    shared = []
    for number, (name, _, slots, offset, multiplier) in enumerate(channels):
        block = [f"channel.name={name}"] + conversions(name, slots)
        block += encoder(offset, multiplier, word) if word else []
        block += ["type=integer-data" if word else "type=float-data"]
        shared += [f"lcd-info.{number}.{line}" for line in block]
    if variant != "plain":
        files["shared-data/header.properties"] = [f"lcd-infos.count={len(channels)}"] + shared
    data = {}
    for number, (kind, control, duration, heights, volts) in enumerate(segments):
        folder = f"segments/{number}/"
        lines = [f"force-segment-header.duration={duration!r}", f"force-segment-header.num-points={len(volts)}",
                 "force-segment-header.time-stamp=2026-01-01 10\\:00\\:00.000 +0000",
                 f"force-segment-header.settings.style={kind}",
                 f"force-segment-header.settings.segment-settings.type={control}",
                 f"force-segment-header.baseline.baseline={BASELINE!r}", "force-segment-header.baseline.measured=true",
                 "channels.list=height vDeflection"]
        for index, (name, stored, slots, offset, multiplier) in enumerate(channels):
            at = f"channel.{name}."
            lines += [at + f"data.file.name=channels/{name}.dat", at + "data.file.format=raw"]
            if variant == "plain":
                lines += [at + "data.type=short"] + [at + "data." + line for line in encoder(offset, multiplier, word)]
                lines += [at + line for line in conversions(name, slots)]
            else:
                lines += [at + f"lcd-info.*={index}"]
            values = stored(heights, volts)
            if word:
                values = [round((value - offset) / multiplier) for value in values]
            data[folder + f"channels/{name}.dat"] = struct.pack(f">{len(values)}{letter}", *values)
        files[folder + "segment-header.properties"] = lines
    method = zipfile.ZIP_STORED if variant == "plain" else zipfile.ZIP_DEFLATED
    with zipfile.ZipFile(out, "w", method) as archive:
        archive.writestr("segments/", b"")
        for name, lines in files.items():
            archive.writestr(name, "\n".join(lines) + "\n")
        for name, samples in data.items():
            archive.writestr(name, samples)


write(sys.argv[1], sys.argv[2], from_csv(sys.argv[3]) if len(sys.argv) > 3 else small(), len(sys.argv) > 3)
