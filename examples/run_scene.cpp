// How does an organ answer a ramp and a hold, and how far do its neighbours of the contact move?
// Runs the scene of a file and writes the whole motion for ParaView.
//
//     run_scene examples/block_scene.json
//
// Prints:
//     A block of tissue under a sphere
//     284 spheres, 1957 bonds, driven at sphere 13 by quasi_static
//     stiffness 77.5 N/m, at equilibrium 39.7 N/m
//       0.0 s: imposed 0, response 0.0000, 0 spheres moved by more than 0.1 mm
//       8.0 s: imposed 0.004, response 0.2029, 142 spheres moved by more than 0.1 mm
//      16.0 s: imposed 0.004, response 0.1718, 149 spheres moved by more than 0.1 mm
//      24.0 s: imposed 0.004, response 0.1576, 154 spheres moved by more than 0.1 mm
//      32.0 s: imposed 0.004, response 0.1510, 156 spheres moved by more than 0.1 mm
//     wrote scene_run.h5
//     wrote scene_run.xdmf
#include <cstdio>
#include <tpmkit/error.hpp>
#include <tpmkit/scene.hpp>

int main(int argc, char** argv) try {
  if (argc < 2) throw tpm::Error(tpm::ExitCode::usage, "run_scene", "no scene", "run_scene FILE");
  const tpm::organ::Scene scene{std::filesystem::path(argv[1])};
  std::printf("%s\n%zu spheres, %zu bonds, driven at sphere %zu by %s\n", scene.title().c_str(),
              scene.organ().size(), scene.bonds(), scene.contact() + 1,
              scene.formulation().c_str());
  std::printf("stiffness %.1f N/m, at equilibrium %.1f N/m\n",
              scene.instantaneous_stiffness_N_per_m(), scene.equilibrium_stiffness_N_per_m());
  const double start_s = scene.protocol().start_s(), end_s = scene.protocol().end_s();
  std::vector<double> times_s;
  for (int i = 0; i <= 4; ++i) times_s.push_back(start_s + i * (end_s - start_s) / 4.0);
  const tpm::organ::Trajectory answer = scene.run(times_s, true);
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const Eigen::RowVectorXd moved_m = answer.displacement[i].colwise().norm();
    std::printf("%5.1f s: imposed %.4g, response %.4f, %ld spheres moved by more than 0.1 mm\n",
                times_s[i], value_at(scene.protocol(), times_s[i]),
                answer.response[static_cast<Eigen::Index>(i)],
                static_cast<long>((moved_m.array() > 1e-4).count()));
  }
  for (const auto& file : scene.simulate("scene_run.h5")) std::printf("wrote %s\n", file.c_str());
} catch (const tpm::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return static_cast<int>(error.code());
}
