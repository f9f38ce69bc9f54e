#pragma once
#include <array>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tpm {

/// Capabilities of a formulation. A request beyond them is refused with the names of those that
/// have them.
struct Capabilities {
  bool network = false;           ///< any tissue of a scene; else the star of four spheres only
  bool depth = false;             ///< driven by an imposed depth
  bool load = false;              ///< driven by an imposed load
  bool jumps = false;             ///< the imposed depth or load may jump
  bool field = false;             ///< displacements of all spheres
  bool masses = false;            ///< spheres may have mass
  bool several_contacts = false;  ///< patches, or several driven spheres
  bool tools = false;             ///< rigid balls and punches
  bool own_protocols = false;     ///< contacts with protocols of their own
  bool dead_loads = false;        ///< gravity and pressure before and beside what is imposed
  bool servo = false;             ///< steps a contact at a fixed rate in bounded time
  bool derivatives = false;       ///< exact derivatives by the parameters
  bool course = true;             ///< has a history; otherwise each instant is independent
  bool beforehand = false;        ///< needs the whole protocol before it begins
  bool planned = false;           ///< `tpm plan` considers it
  // Materials of the bonds (docs/materials.md).
  bool branches = false;       ///< several relaxation times
  bool stiffening = false;     ///< a potential that stiffens as a cubic
  bool any_potential = false;  ///< any potential
  bool kernels = false;        ///< branches on a kernel
  bool regions = false;        ///< stiffer or softer by a factor of place
  bool mixed = false;          ///< regions that relax differently
};

/// A capability with its name in lists and its words in messages: "a formulation that ...".
struct CapabilityEntry {
  bool Capabilities::*meaning;
  std::string_view text;
  std::string_view words;
};
inline constexpr std::array<CapabilityEntry, 21> kCapabilities{{
    {&Capabilities::network, "network", "runs on any network, not only on the star"},
    {&Capabilities::depth, "depth", "is driven by a depth"},
    {&Capabilities::load, "load", "is driven by a load"},
    {&Capabilities::jumps, "jumps", "takes jumps of what is imposed"},
    {&Capabilities::field, "field", "knows the displacements of all spheres"},
    {&Capabilities::masses, "masses", "gives spheres mass"},
    {&Capabilities::several_contacts, "several_contacts", "drives several spheres"},
    {&Capabilities::tools, "tools", "lets tools touch and leave"},
    {&Capabilities::own_protocols, "own_protocols", "drives contacts by protocols of their own"},
    {&Capabilities::dead_loads, "dead_loads", "starts under gravity and pressure"},
    {&Capabilities::servo, "servo", "steps a contact at a servo's rate"},
    {&Capabilities::derivatives, "derivatives", "has derivatives by the parameters"},
    {&Capabilities::course, "course", "follows the course of time"},
    {&Capabilities::beforehand, "beforehand", "needs the protocol beforehand"},
    {&Capabilities::planned, "planned", "is considered by tpm plan"},
    {&Capabilities::branches, "branches", "takes several relaxation times"},
    {&Capabilities::stiffening, "stiffening", "takes a potential that stiffens as a cubic"},
    {&Capabilities::any_potential, "any_potential", "takes a potential of any shape"},
    {&Capabilities::kernels, "kernels", "takes branches on a kernel"},
    {&Capabilities::regions, "regions", "takes regions of another stiffness"},
    {&Capabilities::mixed, "mixed", "takes regions that relax differently"},
}};

/// The capabilities with every material added to them.
[[nodiscard]] constexpr Capabilities with_any_material(Capabilities can) {
  can.branches = can.stiffening = can.any_potential = true;
  can.kernels = can.regions = can.mixed = true;
  return can;
}

/// One way to compute the response of tissue: equations with a method that solves them. It states
/// its name and capabilities. Its uses are its roles, interfaces that it implements besides this
/// one:
///
/// - ModelMaker (tpmkit/model.hpp), asked by fits, tables, designs: response and derivatives of the
///   element;
/// - SceneRunner (tpmkit/simulation.hpp), asked by scenes and sweeps; by plans, if `planned`;
/// - StateRunner (organ/run/scene_runner.hpp), asked by scenes: all states, with checkpoints;
/// - PlanOffer (plan/plan_model.hpp), asked by plans: candidates that claim an error and a cost;
/// - LoopMaker (haptics/session/loop_maker.hpp), asked by sessions: the model that the servo loop
/// steps.
///
/// Formulations are immutable (docs/adding.md, "A formulation").
class Formulation {
 public:
  /// Entry of a formulation in a list.
  struct Entry {
    std::string_view name;     ///< its name in files
    std::string_view meaning;  ///< one sentence without a full stop
    Capabilities can;
    int rank = 1000;  ///< place in lists: the cheap ones first
    /// Keys of a scene's block `formulation` that it takes besides `kind`.
    std::vector<std::string_view> keys = {};
    std::string_view also = {};  ///< an older name in files; may be empty
  };

  explicit Formulation(Entry entry) : entry_(std::move(entry)) {}
  Formulation(const Formulation&) = delete;
  Formulation& operator=(const Formulation&) = delete;
  virtual ~Formulation() = default;

  [[nodiscard]] std::string_view name() const { return entry_.name; }
  [[nodiscard]] std::string_view meaning() const { return entry_.meaning; }
  [[nodiscard]] const Capabilities& can() const { return entry_.can; }
  [[nodiscard]] int rank() const { return entry_.rank; }
  [[nodiscard]] std::string_view also() const { return entry_.also; }
  [[nodiscard]] const std::vector<std::string_view>& keys() const { return entry_.keys; }
  [[nodiscard]] bool takes(std::string_view key) const;

  /// This formulation in one of its roles; null if it does not have it.
  template <class Role>
  [[nodiscard]] const Role* as() const {
    return dynamic_cast<const Role*>(this);
  }

 private:
  Entry entry_;
};

using Formulations = std::span<const Formulation* const>;

/// The formulations of this library by rank: of the component haptics all, of the component plan
/// those of scenes alone. The build lists them from the files of plan/formulations and
/// haptics/formulations.
[[nodiscard]] Formulations shipped_formulations();

/// All formulations by rank: those of the library. A program adds its own by defining this function
/// itself,
///
///     tpm::Formulations tpm::formulations() {
///       static const auto all = joined({shipped_formulations(), own_formulations()});
///       return all;
///     }
[[nodiscard]] Formulations formulations();

/// formulations() of the program that is running. The library asks by this name, which needs no
/// list to be linked. Throws std::logic_error where none is: neither the component plan nor haptics
/// is linked, and the program defines none itself.
[[nodiscard]] Formulations linked_formulations();

/// Joins several lists, ordered by rank and name. Throws std::logic_error if two share a name.
[[nodiscard]] std::vector<const Formulation*> joined(std::initializer_list<Formulations> lists);

/// The formulation of this name; null if there is none.
[[nodiscard]] const Formulation* find_formulation(std::string_view name);

/// Names of the formulations for which `is` is true, separated by commas.
template <class Predicate>
[[nodiscard]] std::string formulations_that(Predicate&& is) {
  std::string names;
  for (const Formulation* f : linked_formulations()) {
    if (is(*f)) names.append(names.empty() ? "" : ", ").append(f->name());
  }
  return names;
}

/// Throws Error(bad_input): no formulation has this name.
/// @param noun the word in the message, such as "formulation"
/// @param able names that are possible
[[noreturn]] void refuse_formulation(std::string_view name, std::string_view noun,
                                     std::string_view where, const std::string& able);
/// Throws Error(bad_input): this formulation lacks the capability; those in `able` have it.
[[noreturn]] void refuse_capability(const Formulation& f, bool Capabilities::*capability,
                                    std::string_view where, const std::string& able);
/// The words of a capability in kCapabilities.
[[nodiscard]] std::string_view words_of(bool Capabilities::*capability);

/// The formulation of this name in the role. Throws Error(bad_input), naming those that have the
/// role.
template <class Role>
[[nodiscard]] const Formulation& formulation_with(std::string_view name, std::string_view noun,
                                                  std::string_view where) {
  const Formulation* f = find_formulation(name);
  if (f != nullptr && f->as<Role>() != nullptr) return *f;
  refuse_formulation(name, noun, where, formulations_that([](const Formulation& other) {
                       return other.as<Role>() != nullptr;
                     }));
}

/// Throws Error(bad_input), naming the formulations of the role that have the capability, unless
/// this one has it.
template <class Role>
void require_can(const Formulation& f, bool Capabilities::*capability, std::string_view where) {
  if (f.can().*capability) return;
  refuse_capability(f, capability, where, formulations_that([&](const Formulation& other) {
                      return other.can().*capability && other.as<Role>() != nullptr;
                    }));
}

}  // namespace tpm
