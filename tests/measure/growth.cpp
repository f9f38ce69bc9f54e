// Prints the measured numbers of reports/networks/report.md and writes its figure:
//
//     measure_growth FOLDER                         everything; FOLDER/figures.json
//     measure_growth KIND COUNT SOLVER [STRIDES]    one case
//
// Every case runs in a process of its own, so that its peak of memory is its own.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>

#include "indentation.hpp"
#include "tpm/files/file.hpp"
#include "tpm/organ/balance/equilibrium.hpp"
#include "tpm/organ/balance/large_equilibrium.hpp"
#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/show/figure.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::show;
using namespace tpm::organ;

namespace {

constexpr double kDepth = 0.002;        // m, of a solid
constexpr double kShellDepth = 0.1;     // in spacings, of a shell
constexpr double kPatchRadius = 0.030;  // m
constexpr double kAnchorDepth = 0.060;  // m of the far side that is held
constexpr double kTolerance = 1e-9;     // N on each sphere

struct Case {
  std::string kind;  ///< solid or shell
  std::size_t count;
  std::string solver;  ///< direct or a preconditioner
  int strides = 2;
};

/// What a case came to; plain numbers, to pass through a pipe.
struct Measured {
  double spacing_m, organ_s, network_s, solve_s, force_N, residual_N;
  double newton, iterations, probe_iterations;
  double spheres, bonds, patch, peak_bytes;
  int failed;
};

/// Time of the processor spent by this process, which a busy machine does not change much.
class Clock {
 public:
  double lap() {
    const std::clock_t now = std::clock();
    const double taken = static_cast<double>(now - last_) / CLOCKS_PER_SEC;
    last_ = now;
    return taken;
  }

 private:
  std::clock_t last_ = std::clock();
};

Organ organ_of(const Case& c) {
  if (c.kind == "shell") {
    LiverRequest request;
    request.count = c.count;
    request.spacing.reset();
    // The size of the paper's liver: 212 spheres at 20 mm in the outer layer.
    request.shape = scaled(LiverShape{}, 0.020 / even_spacing(liver_surface(LiverShape{}), 212));
    return fill_liver(request);
  }
  const LiverShape shape;
  const double unscaled = even_spacing(liver_surface(shape), 212);
  SolidRequest request;
  request.count = c.count;
  const LiverShape sized = scaled(shape, 0.020 / unscaled);
  const MeshSurface surface = liver_surface(sized);
  Organ organ = fill_solid(surface, request);
  const Eigen::Vector3d front = front_of_right_lobe(sized, surface).position;
  Eigen::Index nearest = 0;
  (organ.position.colwise() - front).colwise().squaredNorm().minCoeff(&nearest);
  organ.contact = static_cast<std::size_t>(nearest);
  return organ;
}

void solve(const Case& c, const Network& network, Measured& m) {
  const BondSystem bonds(network, TpmParameters{});
  const Organ& organ = network.organ;
  const auto contact = static_cast<Eigen::Index>(*organ.contact);
  PatchIndentation push;
  push.depth_m = c.kind == "shell" ? kShellDepth * organ.spacing : kDepth;
  push.strides = c.strides;
  push.tolerance_N = kTolerance;
  push.patch = surface_patch(organ, organ.position.col(contact), kPatchRadius);
  Constraints constraints(organ.size());
  for (const std::size_t i : push.patch) constraints.fix(i);
  for (const std::size_t i : far_side(organ, push.direction, kAnchorDepth)) constraints.fix(i);
  IndentationResult result;
  if (c.solver == "direct") {
    Equilibrium solver(bonds, constraints);
    result = indent(bonds, constraints, organ.position, push, finder_of(solver));
  } else {
    LargeEquilibriumOptions options;
    options.preconditioner = parse_word(kPreconditionerWords, "solver", c.solver, "growth");
    LargeEquilibrium solver(bonds, constraints, organ.position, options);
    result = indent(bonds, constraints, organ.position, push, finder_of(solver));
    m.iterations = solver.work().iterations;
    m.probe_iterations = solver.work().probe_iterations;
  }
  m.force_N = result.force_N;
  m.residual_N = result.residual_N;
  m.newton = result.newton_steps;
  m.patch = static_cast<double>(push.patch.size());
}

Measured measure(const Case& c) {
  Measured m{};
  Clock clock;
  Organ organ = organ_of(c);
  m.spacing_m = organ.spacing;
  m.organ_s = clock.lap();
  NetworkOptions options;
  options.spacing_law = SpacingLaw::continuum;
  const Network network = build_network(std::move(organ), options, "growth");
  m.network_s = clock.lap();
  m.spheres = static_cast<double>(network.organ.size());
  m.bonds = static_cast<double>(network.bonds.size());
  try {
    solve(c, network, m);
  } catch (const Error& error) {
    fmt::print("# {} {} {}: {}\n", c.kind, c.count, c.solver, error.what());
    m.failed = 1;
  }
  m.solve_s = clock.lap();
  return m;
}

/// Runs a case in a child and takes its peak of memory from the system.
Measured measure_apart(const Case& c) {
  std::fflush(stdout);
  int ends[2];
  if (pipe(ends) != 0) throw Error(ExitCode::environment, "growth", "no pipe");
  const pid_t child = fork();
  if (child < 0) throw Error(ExitCode::environment, "growth", "no process");
  if (child == 0) {
    const Measured m = measure(c);
    std::fflush(stdout);
    _exit(write(ends[1], &m, sizeof m) == static_cast<ssize_t>(sizeof m) ? 0 : 1);
  }
  close(ends[1]);
  Measured m{};
  const bool whole = read(ends[0], &m, sizeof m) == static_cast<ssize_t>(sizeof m);
  close(ends[0]);
  int status = 0;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  if (!whole || status != 0) m.failed = 1;
  m.peak_bytes = 1024.0 * static_cast<double>(usage.ru_maxrss);
  return m;
}

void print_header() {
  fmt::print(
      "{:<6} {:>7} {:<20} {:>7} {:>6} {:>8} {:>8} {:>8} {:>9} {:>6} {:>6} {:>6} {:>9} {:>8}\n",
      "kind", "spheres", "solver", "x mm", "patch", "fill s", "join s", "solve s", "peak GiB",
      "Newton", "CG", "probe", "force N", "left N");
}

void print_case(const Case& c, const Measured& m) {
  fmt::print(
      "{:<6} {:>7.0f} {:<20} {:>7.3f} {:>6.0f} {:>8.2f} {:>8.2f} {:>8.2f} {:>9.3f} {:>6.0f} "
      "{:>6.0f} {:>6.0f} {:>9.5f} {:>8.1e}{}\n",
      c.kind, m.spheres, c.solver, m.spacing_m * 1e3, m.patch, m.organ_s, m.network_s, m.solve_s,
      m.peak_bytes / 1073741824.0, m.newton, m.iterations, m.probe_iterations, m.force_N,
      m.residual_N, m.failed != 0 ? "  FAILED" : "");
  std::fflush(stdout);
}

/// Slope of log y against log x, least squares.
double exponent(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<Eigen::Index>(x.size());
  Eigen::MatrixX2d a(n, 2);
  Eigen::VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    a.row(i) << 1.0, std::log(x[static_cast<std::size_t>(i)]);
    b[i] = std::log(y[static_cast<std::size_t>(i)]);
  }
  return a.colPivHouseholderQr().solve(b)[1];
}

/// block_jacobi as words.
std::string spoken(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

struct Curve {
  std::vector<double> spheres, seconds, gib;
};

Curve measure_curve(const std::string& kind, const std::string& solver,
                    const std::vector<std::size_t>& counts) {
  Curve curve;
  for (const std::size_t count : counts) {
    const Case c{kind, count, solver};
    const Measured m = measure_apart(c);
    print_case(c, m);
    if (m.failed != 0) continue;
    curve.spheres.push_back(m.spheres);
    curve.seconds.push_back(m.solve_s);
    curve.gib.push_back(m.peak_bytes / 1073741824.0);
  }
  if (curve.spheres.size() > 1) {
    fmt::print("# {} {}: solve time ~ n^{:.2f}, peak memory ~ n^{:.2f}\n", kind, solver,
               exponent(curve.spheres, curve.seconds), exponent(curve.spheres, curve.gib));
  }
  return curve;
}

void measure_all(const std::filesystem::path& folder) {
  const std::vector<std::size_t> all{424, 4000, 40'000, 400'000};
  struct Asked {
    std::string kind, solver;
    std::vector<std::size_t> counts;
  };
  const std::vector<std::size_t> fewer{424, 4000, 40'000};
  const std::vector<Asked> asked{{"solid", "multigrid", all},
                                 {"shell", "multigrid", all},
                                 {"solid", "direct", {424, 1300, 4000}},
                                 {"solid", "block_jacobi", fewer},
                                 {"solid", "incomplete_cholesky", fewer},
                                 {"shell", "direct", {424, 4000}}};
  Figure figure{"growth", "One indentation of a liver against the number of spheres", "", {}};
  Panel time{"Solution", {"spheres", "", true, {}, {}}, {"processor time", "s", true, {}, {}}, {}};
  Panel memory{"Peak memory", {"spheres", "", true, {}, {}}, {"memory", "GiB", true, {}, {}}, {}};
  print_header();
  for (const Asked& a : asked) {
    const Curve curve = measure_curve(a.kind, a.solver, a.counts);
    const std::string label = fmt::format("{}, {}", a.kind, spoken(a.solver));
    time.series.push_back(line(label, curve.spheres, curve.seconds));
    memory.series.push_back(line(label, curve.spheres, curve.gib));
  }
  figure.panels = {time, memory};
  write_file(folder / "figures.json", to_text(to_json(std::vector<Figure>{figure})));
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 2) {
      measure_all(argv[1]);
      return 0;
    }
    if (argc < 4) {
      fmt::print(stderr, "measure_growth FOLDER | KIND COUNT SOLVER [STRIDES]\n");
      return 2;
    }
    Case c{argv[1], std::strtoul(argv[2], nullptr, 10), argv[3]};
    if (argc > 4) c.strides = std::atoi(argv[4]);
    print_header();
    print_case(c, measure_apart(c));
    return 0;
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return static_cast<int>(error.code());
  }
}
