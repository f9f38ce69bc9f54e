"""Cases of scripts/answer_table.py: fits and what they say of their answers (section `fits`).

Recordings are made here, by formulas that share nothing with the program: the memory integral of G(t) = k_inf + sum k
exp(-t/tau) over V(u) = u_ref (u/u_ref)^m is stepped with 40 pieces in each sample.
"""
import json
import math
import random
from pathlib import Path


def history(depth_mm, ramp_s, hold_s, step_s):
    count = round((ramp_s + hold_s) / step_s) + 1
    times = [i * step_s for i in range(count)]
    return times, [min(t / ramp_s, 1.0) * depth_mm * 1e-3 for t in times]


def force(times, depths, k_inf, branches, exponent, reference_m, contact_m=0.0):
    pieces, states, answer = 40, [0.0] * len(branches), []
    value = lambda u: reference_m * (max(u - contact_m, 0.0) / reference_m) ** exponent
    last_t, last_v = times[0], value(depths[0])
    relaxed = last_v
    for i, t in enumerate(times):
        for piece in range(pieces if i else 0):
            share = (piece + 1) / pieces
            u = depths[i - 1] + (depths[i] - depths[i - 1]) * share
            now = times[i - 1] + (t - times[i - 1]) * share
            v, h = value(u), now - last_t
            for b, (_, tau) in enumerate(branches):
                decay = math.exp(-h / tau)
                states[b] = states[b] * decay + (v - last_v) / h * tau * (1.0 - decay)
            last_t, last_v = now, v
        answer.append(k_inf * last_v + sum(k * s for (k, _), s in zip(branches, states)))
    return answer


def rows(header, *columns):
    return header + "\n" + "".join(",".join(f"{x:.10g}" for x in row) + "\n" for row in zip(*columns))


def noisy(values, share, seed):
    draw, peak = random.Random(seed), max(values)
    return [v + share * peak * draw.gauss(0.0, 1.0) for v in values]


def recording(folder, name, depth_mm=4.0, exponent=1.0, k_inf=20.0, branches=((40.0, 1.5),), noise=0.005, seed=1,
              ramp_s=2.0, hold_s=20.0, step_s=0.05, contact_mm=0.0, header="time [s],depth [mm],force [N]", scale=1.0):
    times, depths = history(depth_mm, ramp_s, hold_s, step_s)
    answer = force(times, depths, k_inf, branches, exponent, 1e-3, contact_mm * 1e-3)
    text = rows(header, times, [1e3 * u for u in depths], [scale * f for f in noisy(answer, noise, seed)])
    Path(folder, name).parent.mkdir(exist_ok=True)
    Path(folder, name).write_text(text)


def folder_of_depths(folder):
    for i, depth in enumerate([2.0, 3.5, 5.0, 6.5, 8.0]):
        recording(folder, f"in/rec_{i}.csv", depth_mm=depth, exponent=2.0, seed=i)


def folder_of_repeats(folder):
    for animal, stiffness in (("pig1", 1.0), ("pig2", 1.3), ("pig3", 0.8)):
        for i, depth in enumerate([3.0, 5.0, 7.0]):
            recording(folder, f"in/{animal}_{i}.csv", depth_mm=depth, k_inf=20.0 * stiffness,
                      branches=((40.0 * stiffness, 1.5),), exponent=2.0, seed=10 * i + len(animal))


def strain_file(header, drive=100.0, stress=1e-3):
    def make(folder):
        times, strain = history(50.0, 2.0, 15.0, 0.1)
        answer = force(times, strain, 2000.0, ((3000.0, 3.0),), 1.0, 1.0)
        Path(folder, "t.csv").write_text(rows(header, times, [drive * e for e in strain],
                                              [stress * s for s in noisy(answer, 0.002, 5)]))
    return make


def creep_problem(folder, law="linear-1-fluid", noise=0.01, known=True):
    times = [0.01 * 10 ** (4 * i / 161) for i in range(162)]
    draw = random.Random(2)
    depths = [0.2 / 50.0 * (1.0 + t / 3.0) * (1.0 + noise * draw.gauss(0.0, 1.0)) for t in times]
    text = "load_N,time_s,depth_mm,provenance\n" + "".join(f"0.2,{t:.17g},{1e3 * u:.17g},assumed\n" for t, u in zip(times, depths))
    Path(folder, "creep.csv").write_text(text)
    column = {"load_N": ("load", "N"), "time_s": ("time", "s"), "depth_mm": ("indentation_depth", "mm")}
    Path(folder, "creep.json").write_text(json.dumps({
        "id": "creep", "title": "creep", "kind": "points", "observable": "indentation_depth", "time_origin": "load_applied",
        "citation": "synthetic", "columns": {n: {"quantity": q, "unit": u} for n, (q, u) in column.items()}}))
    stiff = {"start": "20 N/m", "lower": "0 N/m", "upper": "1e5 N/m", "scale": "linear"}
    ranges = {"k": stiff, "t": {"start": "1 s", "lower": "0.001 s", "upper": "1000 s", "scale": "log"},
              "a": {"start": "0.5", "lower": "0.01", "upper": "1", "scale": "linear"},
              "e": {"start": "1.5", "lower": "1", "upper": "6", "scale": "linear"},
              "s": {"start": "20 mm", "lower": "1 mm", "upper": "1000 mm", "scale": "inverse_square"}}
    names = {"linear-1-fluid": "k1 tau1", "hertz-fspringpot": "k1 alpha", "power-fzener": "k_inf k1 tau1 alpha exponent",
             "linear-1-elastic": "k_inf k1 tau1 k_tension spacing",
             "linear-3-elastic": "k_inf k1 k2 k3 tau1 tau2 tau3 k_tension spacing"}[law].split()
    parameters = {n: {**ranges["s" if n == "spacing" else n[0]], "sets": [n]} for n in names}
    Path(folder, "fit.json").write_text(json.dumps({
        "title": law, "law": {"name": law, "reference": "1 mm"}, "parameters": parameters,
        "fixed": {"contact": "0 mm", "offset": "0 N"}, "starts": {"count": 1, "seed": 0},
        "data": [{"dataset": "creep.csv", "protocol": {"kind": "creep"},
                  "noise": {"kind": "relative_to_datum", "relative": 0.01, "scale": "known" if known else "estimated"}}]}))


def spectrum_problem(folder):
    lines = ["frequency_Hz,storage_kPa,loss_kPa"]
    for i in range(12):
        w = 2 * math.pi * 0.01 * 10 ** (i * 4 / 11)
        x = 2.0 * w
        lines.append(f"{w / 2 / math.pi:.9g},{1 + 3 * x * x / (1 + x * x):.9g},{3 * x / (1 + x * x):.9g}")
    Path(folder, "s.csv").write_text("\n".join(lines) + "\n")
    column = {"frequency_Hz": ("frequency", "Hz"), "storage_kPa": ("storage_modulus", "kPa"), "loss_kPa": ("loss_modulus", "kPa")}
    Path(folder, "s.json").write_text(json.dumps({
        "id": "s", "title": "s", "kind": "spectrum", "provenance": "assumed", "citation": "synthetic",
        "columns": {n: {"quantity": q, "unit": u} for n, (q, u) in column.items()}}))
    stiff = {"start": "1 kPa", "lower": "0.001 kPa", "upper": "1000 kPa", "scale": "log"}
    Path(folder, "fit.json").write_text(json.dumps({
        "title": "spectrum", "law": {"name": "linear-1", "drive": "relative_length", "reference": "1"},
        "parameters": {"k_inf": stiff, "k1": stiff, "tau1": {"start": "1 s", "lower": "0.01 s", "upper": "100 s", "scale": "log"}},
        "data": [{"dataset": "s.csv", "protocol": {"kind": "oscillation"}, "noise": {"kind": "log", "relative": 0.1}}]}))


def function_file(header, kind):
    def make(folder):
        columns, draw = [], random.Random(9)
        for i in range(40):
            t = 0.01 * 10 ** (i * 4 / 39)
            x = 2.0 * t
            storage, loss = 1000 + 3000 * x * x / (1 + x * x), 3000 * x / (1 + x * x)
            columns.append({"G": (t, 1000 + 3000 * math.exp(-t / 2)), "J": (t, 1e-3 - 0.75e-3 * math.exp(-t / 8)),
                            "step": (t, 1.0, 10 + 30 * math.exp(-t / 2)), "parts": (t, storage, loss),
                            "polar": (t, math.hypot(storage, loss), math.degrees(math.atan2(loss, storage)))}[kind])
            columns[-1] = columns[-1][:-1] + (columns[-1][-1] * (1.0 + 0.01 * draw.gauss(0.0, 1.0)),)
        Path(folder, "f.csv").write_text(rows(header, *zip(*columns)))
    return make


LAW = {"drive": "indentation_depth", "response": "contact_force", "provenance": "assumed"}


def deep_hertz(folder):
    Path(folder, "l.json").write_text(json.dumps({**LAW, "law": "hertz-1", "reference_m": 0.008,
                                                  "parameters": {"k_inf_N_per_m": 20.0, "k1_N_per_m": 30.0, "tau1_s": 1.5}}))


def law_with_tension(folder):
    Path(folder, "l.json").write_text(json.dumps({**LAW, "law": "linear-1-elastic", "reference_m": 0.002, "parameters": {
        "k_inf_N_per_m": 20.0, "k1_N_per_m": 30.0, "tau1_s": 1.5, "k_tension_N_per_m": 60.0, "spacing_m": 0.02}}))


def one_late_sample(folder):
    recording(folder, "r.csv", hold_s=10.0)
    with open(Path(folder, "r.csv"), "a", encoding="ascii") as out:
        out.write("12.1,1.0,0.0\n")


def said(folder):
    path = Path(folder, "said")
    text = path.read_text() if path.exists() else ""
    return text if text.strip() else None


def of_json(find):
    """Looks at JSON on standard output; says so if there is none."""
    def look(folder):
        text = said(folder)
        if text is None:
            return "no answer"
        try:
            return find(json.loads(text))
        except (KeyError, IndexError, StopIteration) as missing:
            return f"without {missing!r}"
    return look


def fit_of(answer):
    return answer.get("fit", answer)


def shown(names, factor=1.0, unit=""):
    """Estimate, interval and verdict of parameters."""
    def find(answer):
        parts = []
        for p in fit_of(answer)["parameters"]:
            if p["name"] in names:
                ends = " to ".join("open" if x is None else f"{factor * x:.4g}" for x in p["interval_SI"] or [None, None])
                conditional = ", conditional" if p.get("conditional_on") else ""
                apart = "" if p.get("interval_connected", True) else ", separate ranges"
                parts.append(f"{p['name']} {factor * p['estimate_SI']:.4g}{unit} ({ends}; {p['verdict']}{conditional}{apart})")
        return ", ".join(parts)
    return of_json(find)


def pooled(answer):
    parts = []
    for p in answer["pooled"]:
        if p["name"] in ("k_inf", "k1"):
            parts.append(f"{p['name']} {p['typical_SI']:.4g} {p['unit']}, sd between {p.get('between_specimens_sd_of_log', 0):.3g}, "
                         + (f"p = {p['spread_p_value']:.2g}, " if "spread_p_value" in p else "p in the words alone, ")
                         + f"{p['specimens']} specimens")
    reference = answer.get("depth_reference_m")
    return f"{answer['law']}: " + "; ".join(parts) + (f"; all at {1e3 * reference:.3g} mm" if reference else "; no reference stated")


def recommended(answer):
    return f"{answer['recommended']}; {len(answer['warnings'])} warnings"


def offered(answer):
    hertz = sum(law["law"].startswith("hertz") for law in answer["laws"])
    return f"{hertz} Hertz laws among {len(answer['laws'])}; recommended {answer['recommended']}"


def bars(folder):
    path = Path(folder, "out/figures.json")
    if not path.exists():
        return "no figure"
    for figure in json.loads(path.read_text())["figures"]:
        for panel in figure["panels"]:
            for series in panel["series"]:
                if series.get("label") == "storage" and series.get("y"):
                    sd = series.get("sd") or [0.0]
                    return f"bars of {100 * sd[0] / series['y'][0]:.3g} % of the first reading"
    return "no reading drawn"


def taken(folder):
    path = Path(folder, "spent")
    if not path.exists():
        return "no time"
    children = path.read_text().splitlines()[1].split()[0]
    minutes, seconds = children.rstrip("s").split("m")
    return f"{60 * int(minutes) + float(seconds):.2f} s of processor time"


def peak_words(folder):
    text = said(folder) or ""
    found = [line for line in text.splitlines() if "after the fitted part" in line]
    return found[0][:140] if found else "nothing is said of it"


def tables(folder):
    return ", ".join(sorted(p.name for p in Path(folder, "out").glob("*.csv"))) or "no CSV"


def moduli(answer):
    parts = [f"{m['name']} {m['estimate_SI']:.4g} Pa ({m['interval_SI'][0]:.4g} to {m['interval_SI'][1]:.4g})"
             for m in answer["young_moduli"]["moduli"]]
    return ", ".join(parts) + f"; {answer['young_moduli']['poisson_ratio']} {answer['young_moduli']['poisson_ratio_provenance']}"


JSON = "--no-draw --format json > said"
TIMED = "$TPM fit fit.json --format json > said; code=$?; times > spent; exit $code"


def timed(look):
    return lambda folder: f"{taken(folder)}; {look(folder)}"


def cases(case):
    strain = "Tension test\n\nTime,Strain,Stress\ns,%,kPa"
    given = "--drive Strain --drive-quantity relative_length --response Stress --laws linear-1"
    return [
        case("1", "five recordings of one material (exponent 2), 2 to 8 mm deep", folder_of_depths,
             f"$TPM fit in --laws power-1 {JSON}", "test_specimens: unequal depths", of_json(pooled)),
        case("1", "the same without a law", folder_of_depths, f"$TPM fit in {JSON}", "test_specimens: The law of a folder",
             of_json(pooled)),
        case("1", "three animals, three repeats each", folder_of_repeats,
             f"$TPM fit in --laws power-1 --group-by '(pig[0-9])_' {JSON}", "test_specimens: grouped", of_json(pooled)),
        case("2", "title, blank and unit rows, titles below; columns chosen, and the units of time and stress (2 and 3 kPa)",
             strain_file("Tension test\n\ns,%,kPa\nTime,Strain,Stress"),
             f"$TPM fit t.csv {given} --unit Time=s --unit Stress=kPa {JSON}", "test_import: any order", shown(("k_inf", "k1"), 1e-3, " kPa")),
        case("2", "the same, without options (2 and 3 kPa)", strain_file(strain), f"$TPM fit t.csv {JSON}", "test_rheometer: A strain is recognised",
             shown(("k_inf", "k1"), 1e-3, " kPa")),
        case("2", "units above the titles, title below", strain_file("(s),(%),(kPa)\nTime,Strain,Stress\nTension test\n"),
             f"$TPM fit t.csv {JSON}", "test_rheometer: A strain is recognised", shown(("k1",), 1e-3, " kPa")),
        case("2", "`strain [-]`, stress in mmHg", strain_file("time [s],strain [-],stress [mmHg]", 1.0, 1 / 133.322387415),
             f"$TPM fit t.csv {JSON}", "test_rheometer: A strain is recognised", shown(("k1",), 1e-3, " kPa")),
        case("2", "`force [nN]`", lambda f: recording(f, "r.csv", header="time [s],depth [mm],force [nN]", scale=1e9),
             f"$TPM fit r.csv --laws linear-1 {JSON}", "test_import: a unit that is not known", shown(("k1",), 1.0, " N/m")),
        case("2", "`depth [furlong]`", lambda f: recording(f, "r.csv", header="time [s],depth [furlong],force [N]"),
             f"$TPM fit r.csv {JSON}", "test_import: a unit that is not known"),
        case("2", "a strain without a unit", strain_file("time [s],strain,stress [kPa]"), f"$TPM fit t.csv {JSON}", "test_rheometer: A strain is recognised"),
        case("3", "power kernel (exponent 3.3) in contact 2 mm before its start",
             lambda f: recording(f, "r.csv", depth_mm=4.0, exponent=3.3, contact_mm=-2.0, noise=0.002),
             f"$TPM fit r.csv --laws power-1 {JSON}", "test_fit_bounds: presses is widened", shown(("exponent", "contact"))),
        case("4", "exact Maxwell creep, 162 points", lambda f: creep_problem(f, noise=0.0, known=False), TIMED, "test_fit_bounds: A profile that fails",
             timed(shown(("tau1",), 1.0, " s"))),
        case("5", "classical Maxwell creep, 162 points, 1 % noise, profiles", creep_problem, TIMED, "test_imposed_load: Creep of a Maxwell element",
             timed(shown(("tau1",), 1.0, " s"))),
        *[case("5", f"the same creep, {law}", lambda f, law=law: creep_problem(f, law), TIMED, test, timed(shown(("k1",), 1.0, " N/m")))
          for law, test in (("hertz-fspringpot", "test_springpot_pair_law: a curved kernel creeps"),
                            ("power-fzener", "test_springpot_pair_law: a curved kernel creeps"),
                            ("linear-1-elastic", "test_imposed_load: with elastic tension"),
                            ("linear-3-elastic", "test_imposed_load: with elastic tension"))],
        case("6", "two branches (40 N/m, 1 s; 20 N/m, 2 s) that 2 % noise hardly tells apart",
             lambda f: recording(f, "r.csv", branches=((40.0, 1.0), (20.0, 2.0)), noise=0.02, seed=6, ramp_s=0.5),
             f"$TPM fit r.csv --laws linear-2 {JSON}", "test_rheometer: Branches keep", shown(("k1", "k2", "tau1", "tau2"))),
        case("6", "default law of a 10 s hold, slow relaxation (30 s), 2 % noise",
             lambda f: recording(f, "r.csv", branches=((40.0, 30.0),), noise=0.02, hold_s=10.0, step_s=0.5),
             f"$TPM fit r.csv {JSON}", "test_select: a hold of three relaxation times", of_json(recommended)),
        case("6", "error bars of a spectrum with log noise of 0.1", spectrum_problem, "$TPM fit fit.json --folder out > said",
             "test_oscillation: error bars", bars),
        case("6", "a Hertz law at 8 mm, a ball of 7.5 mm", deep_hertz, "$TPM export l.json --to abaqus --radius '7.5 mm' > said",
             "test_law_spectrum: deep for the ball"),
        case("6", "`--relaxation-only` of a law with elastic tension", law_with_tension,
             "$TPM export l.json --to abaqus --relaxation-only > said", "test_law_spectrum: what cannot be said is refused"),
        case("6", "laws offered for a shear strain", strain_file("time [s],shear strain [%],shear stress [kPa]"),
             f"$TPM fit t.csv --drive 2 --response 3 {JSON}", "test_rheometer: A strain is fitted", of_json(offered)),
        case("6", "one sample after the fitted part", one_late_sample, "$TPM fit r.csv --laws linear-1 --no-draw > said",
             "test_select: few samples are no prediction", peak_words),
        *[case("build", what, function_file(header, kind), f"$TPM fit f.csv {JSON}", test,
               shown(("k_inf", "k1", "tau1")))
          for what, header, kind, test in (
              ("`t [s], G(t) [Pa]`", "t [s],G(t) [Pa]", "G", "test_material_function: A relaxation modulus is fitted"),
              ("`time [s], J [1/Pa]`", "time [s],J [1/Pa]", "J", "test_material_function: A creep compliance is fitted"),
              ("`omega [rad/s], G' [Pa], G'' [Pa]`", "omega [rad/s],G' [Pa],G'' [Pa]", "parts", "test_rheometer: Columns that only"),
              ("`w [rad/s], |G*| [Pa], delta [deg]`".replace("|", "&#124;"), "w [rad/s],|G*| [Pa],delta [deg]", "polar",
               "test_material_function: from magnitude and phase"),
              ("a shear strain of 1 % that is kept", "time [s],shear strain [%],shear stress [Pa]", "step",
               "test_rheometer: kept makes"))],
        case("build", "`length [mm]` of a specimen of 20 mm", strain_file("time [s],length [mm],stress [kPa]", 20.0),
             f"$TPM fit t.csv {JSON}", "test_rheometer: A length"),
        case("build", "a sphere of 5 mm in 4 + 6 kPa, Poisson's ratio 0.45",
             lambda f: recording(f, "r.csv", depth_mm=0.5, exponent=1.5, k_inf=4e3 * 4 / 3 / (1 - 0.45 ** 2) * math.sqrt(5e-3 * 1e-3),
                                 branches=((6e3 * 4 / 3 / (1 - 0.45 ** 2) * math.sqrt(5e-3 * 1e-3), 3.0),)),
             f"$TPM fit r.csv --radius '5 mm' --poisson 0.45 {JSON}", "test_rheometer: Indentations answer", of_json(moduli)),
        case("build", "tables beside the JSON", lambda f: recording(f, "r.csv"),
             "$TPM fit r.csv --laws linear-1 --folder out > said", "test_rheometer: A strain is fitted", tables),
    ]


INTRODUCTION = """Items are those of "No wrong number", 1 to 6, and what was built for rheologists' files. Recordings are
made by the script from formulas with known coefficients; no number of this page was measured. Times are processor
times of one run beside other work."""

RELATIVES = """## Relatives found and mended

| where | what it said | now |
| --- | --- | --- |
| import | `strain`, `gamma`, `length`, `t`, `w`, `J`, `G` were no titles; a strain without a unit was a plain number | recognised by title or unit; a strain without a unit stops the import |
| import | `Dehnung [%]` was a displacement in a unit of nothing | a strain |
| import | a rheometer's normal force went before its shear stress | the response of a strain is a stress, if there is one |
| import | negative compression: "the drive never rises" | names `--negate-drive`, `--negate-response` |
| pooling | a spread of a linear parameter stood under `between_specimens_sd_of_log`, "in theta" | `between_specimens_sd_SI`, "in the natural logarithm" or with its unit |
| pooling | typical specimens without the level of their interval; new specimens without a unit | both stand there |
| selection | "the simplest law that the data support" though no law was identified | "identify none of the laws"; laws that the protocol contradicts come last |
| text of fits | chi-square of a noise whose size was estimated, without a word | the factor by which the stated noise was multiplied |
| profiles | walks of one branch went on into the values of another | kept in their order (`ExchangeOrder`), also in starts, minima, bootstrap and coverage |
| export | `--` in a comment of FEBio's XML, which is not well-formed | worded without |
| export | the depth that the law was fitted to was not looked at, only its reference | both are |
| figures | moduli and compliances without error bars | drawn, with the noise's own size |
"""
