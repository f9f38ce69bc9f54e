#pragma once
#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "tpm/fit/predict/organ_prediction.hpp"
#include "tpm/fit/predict/other_fillings.hpp"
#include "tpm/fit/predict/prediction_parts.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_uncertainty.hpp"
#include "tpmkit/model.hpp"

namespace tpm::fit {

/// A fitted law, or an organ that it was put on, along the motion of one recording, without a zero
/// error of the response: what a validation compares the readings with, and how it follows each of
/// its inputs. Of creep the recording's drive is the load, and contact is a load at which nothing
/// is pressed yet.
class LawAlong {
 public:
  /// @param recording of creep as as_load_imposed() gives it; outlives this
  /// @param organ answers in place of the law, on the ramp and hold alone; outlives this
  /// @param motion that the tissue has seen, up to the end of the recording; empty: that of its
  ///               samples
  /// @param rises of that motion, which its samples do not show
  /// Throws Error(bad_input) for a law without uncertainty or a recording of other quantities.
  LawAlong(const LawFile& law, const PreparedRecording& recording,
           const OrganOfLaw* organ = nullptr, std::vector<Knot> motion = {},
           std::vector<DelayedRise> rises = {});

  /// Values and derivatives at one contact point.
  struct At {
    Eigen::VectorXd value;   ///< SI, one a sample; NaN where the law does not predict
    Eigen::MatrixXd by_law;  ///< d value / d coordinate of the law's uncertainty
    Eigen::VectorXd by_contact;
  };
  [[nodiscard]] At at(double contact) const;
  /// d value / d ln(depth beyond contact): of a scale error of the depth channel.
  [[nodiscard]] Eigen::VectorXd by_depth_scale(double contact) const;
  /// d value / d ln(time), and d value / d(time), with which the motion comes later.
  [[nodiscard]] Eigen::VectorXd by_time_scale(double contact) const;
  [[nodiscard]] Eigen::VectorXd by_time_shift(double contact) const;
  /// d value / d(delay) of one of the rises, 1/s.
  [[nodiscard]] Eigen::VectorXd by_delay(std::size_t rise, double contact) const;

  /// One way in which the computation could be coarser.
  struct Refinement {
    std::string name;                     ///< "straight pieces of the motion"
    double ratio = 2.0;                   ///< of neighbouring resolutions
    std::vector<Eigen::VectorXd> values;  ///< from the finest on
  };
  /// Of an organ: the same answer at three resolutions of its motion. None for closed forms.
  [[nodiscard]] std::vector<Refinement> refinements(double contact) const;

  /// Of an organ: its answer, and those of other fillings of its body. Bonds are fitted to the law
  /// at the places of their spheres, so each of the others has one factor on its moduli with which
  /// it comes nearest to the organ, in least squares, along the motion at the depth of the
  /// calibration. Empty if one of them has no equilibrium.
  [[nodiscard]] std::vector<Eigen::VectorXd> by_filling(const OtherFillings& others,
                                                        double contact) const;

  /// Covariance of the law's coordinates is root root'.
  [[nodiscard]] const Eigen::MatrixXd& root() const { return coordinates_.root; }
  /// True if contact is a property of the law, as the slack length of a strip.
  [[nodiscard]] bool contact_of_law() const { return contact_of_law_; }
  [[nodiscard]] double contact_in_law() const { return law_.values[law_.values.size() - 2]; }
  [[nodiscard]] bool load_imposed() const { return load_imposed_; }
  [[nodiscard]] const OrganOfLaw* organ() const { return organ_; }
  [[nodiscard]] const LawFile& law() const { return law_; }
  /// Imposed motion beyond a contact point, as an organ is driven.
  [[nodiscard]] Protocol motion() const { return motion_; }

 private:
  /// Imposed motion with these delays, as the model is driven.
  [[nodiscard]] Protocol driven(std::vector<DelayedRise> rises) const;
  void follow_times(At& at, std::vector<double> values) const;
  [[nodiscard]] Eigen::VectorXd along(const Protocol& motion, double contact,
                                      double later_s = 0.0) const;
  [[nodiscard]] Response respond(const Protocol& motion, const std::vector<double>& times_s,
                                 double contact, Want want) const;

  LawFile law_;
  const Recording& recording_;
  std::shared_ptr<const Model> own_model_;  ///< none for an organ
  const OrganOfLaw* organ_;
  const Model* model_;
  UncertainCoordinates coordinates_;
  bool load_imposed_ = false;
  std::vector<DelayedRise> rises_;
  double to_s_;        ///< end of the ramp and hold
  Protocol straight_;  ///< of every sample, straight between them
  Protocol whole_;     ///< with the rises
  Protocol motion_;    ///< of an organ, in straight pieces to the end of the hold
  bool contact_of_law_ = false;
};

/// True if a quantity is a load: as the drive of a recording it makes it one of creep.
[[nodiscard]] bool is_load(Quantity q) noexcept;

/// A recording of creep with the load as its drive and what it moved as its response.
[[nodiscard]] PreparedRecording as_load_imposed(const PreparedRecording& recording);

}  // namespace tpm::fit
