// Every formulation of the list keeps its word (formulation_suite.hpp).
#include <catch2/catch.hpp>

#include "counted_allocations.hpp"
#include "formulation_suite.hpp"
#include "refusal.hpp"
#include "simulated_scene.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/session/loop_maker.hpp"
#include "tpm/organ/run/scene_runner.hpp"

using namespace tpm;
using namespace tpm::haptics;
using Catch::Matchers::Contains;
using test::experiment;
using test::refusal_of;

namespace {

const std::string kPress = R"("protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s",
  "hold": "1 s"})";

/// Every fourth formulation of the list, from the one at `first`: four tests, which run beside each
/// other.
void check_words(std::size_t first) {
  const Formulations all = formulations();
  REQUIRE(all.size() > first);
  for (std::size_t i = first; i < all.size(); i += 4) {
    DYNAMIC_SECTION(all[i]->name()) {
      CHECK(test::listed(test::broken_words(*all[i])) == "");
    }
  }
}

}  // namespace

TEST_CASE("every formulation keeps its word: 1st, 5th, ...") {
  check_words(0);
}
TEST_CASE("every formulation keeps its word: 2nd, 6th, ...") {
  check_words(1);
}
TEST_CASE("every formulation keeps its word: 3rd, 7th, ...") {
  check_words(2);
}
TEST_CASE("every formulation keeps its word: 4th, 8th, ...") {
  check_words(3);
}

TEST_CASE("what a session steps is at rest, repeats itself and takes nothing from the heap") {
  int stepped = 0;
  for (const Formulation* formulation : formulations()) {
    if (!for_sessions(*formulation)) continue;
    ++stepped;
    DYNAMIC_SECTION(formulation->name()) {
      CHECK(test::listed(test::broken_in_loop(
                *formulation, [] { return tpm::testing::heap_calls.load(); })) == "");
    }
  }
  CHECK(stepped >= 7);
}

TEST_CASE("the page of materials says what the flags say") {
  constexpr std::array kAsked{&Capabilities::branches,      &Capabilities::stiffening,
                              &Capabilities::any_potential, &Capabilities::kernels,
                              &Capabilities::regions,       &Capabilities::mixed};
  // Formulations with the same flags share a row.
  std::vector<std::pair<std::string, std::string>> rows;
  for (const Formulation* f : formulations()) {
    std::string flags;
    for (const auto capability : kAsked) flags += f->can().*capability ? " yes |" : " no |";
    const auto same = std::find_if(rows.begin(), rows.end(),
                                   [&](const auto& row) { return row.second == flags; });
    if (same != rows.end()) {
      same->first.append(", ").append(f->name());
    } else {
      rows.emplace_back(f->name(), flags);
    }
  }
  std::string table =
      "| formulation | branches | stiffening | any_potential | kernels | regions | mixed |\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n";
  for (const auto& [names, flags] : rows) table += "| " + names + " |" + flags + "\n";
  const std::string page = read_file(std::string(TPM_TEST_SOURCE_DIR) + "/docs/materials.md");
  CAPTURE(table);
  CHECK(page.find(table) != std::string::npos);
}

TEST_CASE("the list holds the formulations, each once, by rank") {
  const std::string all = formulations_that([](const Formulation&) { return true; });
  CHECK(all ==
        "closed_form, cvodes, linear, element, curves, condensed, servo_network, static, "
        "network_step, quasi_static, inertial, forward_euler, semi_implicit_euler, rk4, "
        "backward_euler, implicit_midpoint, newmark, tr_bdf2, exponential, xpbd, cvode_adams, "
        "cvode_bdf, ida, surface, law");
  CHECK(find_formulation("collocation") == find_formulation("quasi_static"));
  CHECK(find_formulation("network") == find_formulation("servo_network"));
  CHECK(find_formulation("") == nullptr);
  const Formulations list = formulations();
  CHECK_THROWS_AS(joined({list, list}), std::logic_error);
}

TEST_CASE("a scene that a formulation cannot run names those that can") {
  const auto refused = [](const std::string& kind, const std::string& blocks) {
    const ExperimentScene scene =
        experiment(R"({"organ": {"kind": "liver", "count": 40}, )" + blocks +
                   R"(, "formulation": {"kind": ")" + kind + R"("}})");
    return refusal_of([&] { require_runnable(scene); });
  };
  CHECK_THAT(refused("closed_form", kPress),
             Contains("key /formulation") &&
                 Contains("'closed_form' is no formulation that runs on "
                          "any network, not only on the star; expected one of linear, "));
  CHECK_THAT(refused("rk4", kPress + R"(, "contacts": [{"kind": "ball", "radius": "10 mm"}])"),
             Contains("lets tools touch and leave; expected one of static, network_step, "
                      "quasi_static, inertial"));
  CHECK_THAT(
      refused("condensed", R"("protocol": {"kind": "creep", "load": "0.1 N", "duration": "1 s"})"),
      Contains("is driven by a load"));
  CHECK_THAT(refused("surface", kPress), Contains("unknown formulation of scenes 'surface'"));
  CHECK_THAT(refusal_of([] {
               (void)experiment(R"({"organ": {"kind": "liver", "count": 40}, )" + kPress +
                                R"(, "formulation": {"kind": "magic"}})");
             }),
             Contains("key /formulation/kind") && Contains("unknown formulation 'magic'") &&
                 Contains("one of closed_form, cvodes, linear"));
}

TEST_CASE("settings of a formulation reach it, those of others are refused") {
  const auto parsed = [](const std::string& keys) {
    return experiment(R"({"organ": {"kind": "star"}, )" + kPress + R"(, "formulation": {)" + keys +
                      "}}")
        .formulation;
  };
  const FormulationChoice xpbd = parsed(R"("kind": "xpbd", "step": "2 ms", "sweeps": 7)");
  CHECK(xpbd.step_s == 2e-3);
  CHECK(xpbd.sweeps == 7);
  CHECK_FALSE(xpbd.masses);
  CHECK(parsed(R"("kind": "newmark", "masses": true, "damping_ratio": 0.3)").masses);
  CHECK(parsed(R"("kind": "inertial")").masses);
  CHECK(parsed(R"("kind": "collocation")").kind == "quasi_static");
  for (const char* keys :
       {R"("kind": "rk4", "sweeps": 2)", R"("kind": "quasi_static", "step": "1 ms")",
        R"("kind": "rk4", "masses": false, "damping_ratio": 0.1)",
        R"("kind": "curves", "exponentials": 4)", R"("kind": "rk4", "step": "0 s")"}) {
    CAPTURE(keys);
    CHECK_THROWS_AS(parsed(keys), Error);
  }
}
