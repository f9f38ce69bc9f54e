#pragma once
#include <Eigen/Core>
#include <vector>

#include "tpm/fit/predict/prediction_parts.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {

/// A fitted law along the motion of one recording, without a zero error of the response: what a
/// validation compares the readings with, and how it follows each of its inputs.
class LawAlong {
 public:
  /// Throws Error(bad_input) for a law without uncertainty or a recording of other quantities.
  LawAlong(const LawFile& law, const PreparedRecording& recording);

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

  /// Covariance of the law's coordinates is root root'.
  [[nodiscard]] const Eigen::MatrixXd& root() const { return coordinates_.root; }
  /// Whether contact is a property of the law, as the slack length of a strip.
  [[nodiscard]] bool contact_of_law() const { return contact_of_law_; }
  [[nodiscard]] double contact_in_law() const { return law_.values[law_.values.size() - 2]; }
  [[nodiscard]] const LawFile& law() const { return law_; }

 private:
  [[nodiscard]] Eigen::VectorXd along(const std::vector<double>& time_s,
                                      const std::vector<double>& drive, double contact) const;

  LawFile law_;
  const Recording& recording_;
  LawModel model_;
  UncertainCoordinates coordinates_;
  bool contact_of_law_ = false;
};

}  // namespace tpm::fit
