// Declared in tpm/accuracy/verify/verification.hpp.
// Contact models at servo rate against the quasi-static network that they reduce.
#include <algorithm>
#include <memory>

#include "tpm/accuracy/contact_reference.hpp"
#include "tpm/accuracy/verify/verification.hpp"
#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/files/file.hpp"
#include "tpm/organ/scene/scene.hpp"

namespace tpm::accuracy {
namespace {

constexpr double kDeepest_m = 8e-3, kPushSpeed = 0.02, kHold_s = 0.4, kCompared_s = 4e-3;
constexpr double kReferenceTolerance = 1e-8, kReferenceError = 10.0 * kReferenceTolerance;

/// The liver of 424 spheres with a relaxation time of 0.1 s, pushed and held.
class ReducedLiver {
 public:
  ReducedLiver()
      : tissue_(read_tissue(share_dir() / "configs" / "liver_scene.json")),
        constraints_(tissue_.constraints()),
        contact_(tissue_.network.organ.contact.value()),
        into_(-tissue_.network.organ.normal.col(static_cast<Eigen::Index>(contact_))),
        motion_(ramp_motion(into_, kDeepest_m, kPushSpeed, kHold_s, kCompared_s)) {
    set_value(tissue_.materials.materials.front(), "tau1", 0.1, "verification");
  }

  /// With an equilibrium modulus that is wrong by a share.
  [[nodiscard]] BondSystem bonds(double flaw) const {
    MaterialField materials = tissue_.materials;
    materials.materials.front().equilibrium_Pa *= 1.0 + flaw;
    return {tissue_.network, materials};
  }
  [[nodiscard]] const Positions& rest() const { return tissue_.network.organ.position; }
  [[nodiscard]] const Constraints& constraints() const { return constraints_; }
  [[nodiscard]] std::size_t contact() const { return contact_; }
  [[nodiscard]] const Eigen::Vector3d& into() const { return into_; }

  /// Forces along the push at the end of each period of comparison, found when first asked for.
  const Eigen::VectorXd& reference() {
    if (reference_.size() == 0) {
      const BondSystem right = bonds(0.0);
      reference_ =
          line_reference({right, rest(), constraints_, contact_}, motion_, kReferenceTolerance);
    }
    return reference_;
  }

  struct Stepped {
    Eigen::VectorXd force_N, claimed_N;
  };
  /// The same of a model that is stepped at its own period.
  [[nodiscard]] Stepped stepped(ContactModel& model) const {
    const int pieces = static_cast<int>(std::lround(motion_.period_s / model.period_s()));
    const ContactMotion fine = refined(motion_, pieces);
    Stepped found{Eigen::VectorXd(motion_.steps()), Eigen::VectorXd(motion_.steps())};
    model.reset();
    for (Eigen::Index i = 0; i < fine.steps(); ++i) {
      const ContactAnswer answer = model.step(fine.displacement_m.col(i));
      if ((i + 1) % pieces != 0) continue;
      found.force_N[i / pieces] = answer.force_N.dot(into_);
      found.claimed_N[i / pieces] = answer.error_N;
    }
    return found;
  }

 private:
  Tissue tissue_;
  Constraints constraints_;
  std::size_t contact_;
  Eigen::Vector3d into_;
  ContactMotion motion_;
  Eigen::VectorXd reference_;
};

using LiverPtr = std::shared_ptr<ReducedLiver>;
using MakeModel = std::function<std::unique_ptr<ContactModel>(const ReducedLiver&, double flaw)>;

/// @param allowed error of the peak
void add_model_checks(std::vector<VerificationCheck>& all, const LiverPtr& liver,
                      const std::string& name, double allowed, const MakeModel& make) {
  const std::string source = "quasi-static network at a tolerance of 1e-8, all 424 spheres";
  all.push_back({name + ", 8 mm in 0.4 s and held", "largest error of the peak", source, 0.0,
                 allowed, [=](double flaw) {
                   const auto model = make(*liver, flaw);
                   return relative_difference(liver->stepped(*model).force_N, liver->reference());
                 }});
  all.push_back({name + ", the error that it claims", "largest error over claimed error", source,
                 0.0, 1.0, [=](double flaw) {
                   const auto model = make(*liver, flaw);
                   const ReducedLiver::Stepped found = liver->stepped(*model);
                   const Eigen::VectorXd& right = liver->reference();
                   // Errors that the reference itself may have are nobody's.
                   const double floor_N = kReferenceError * right.cwiseAbs().maxCoeff();
                   const Eigen::ArrayXd error = (found.force_N - right).cwiseAbs();
                   return ((error - floor_N).max(0.0) / found.claimed_N.array()).maxCoeff();
                 }});
}

}  // namespace

std::vector<VerificationCheck> reduction_checks() {
  const auto liver = std::make_shared<ReducedLiver>();
  std::vector<VerificationCheck> checks;
  add_model_checks(checks, liver, "condensed contact, 1 kHz", 5e-3,
                   [](const ReducedLiver& l, double flaw) -> std::unique_ptr<ContactModel> {
                     return std::make_unique<CondensedContact>(
                         build_condensed(l.bonds(flaw), l.rest(), l.constraints(), l.contact(),
                                         l.into(), {.depth_m = kDeepest_m}));
                   });
  add_model_checks(checks, liver, "full network in single precision, 1 kHz", 1e-3,
                   [](const ReducedLiver& l, double flaw) -> std::unique_ptr<ContactModel> {
                     return std::make_unique<ServoNetwork>(l.bonds(flaw), l.rest(), l.constraints(),
                                                           l.contact(), l.into());
                   });
  return checks;
}

}  // namespace tpm::accuracy
