#include "tpm/organ/steps/viscous_elongations.hpp"

namespace tpm::organ {

ViscousElongations::ViscousElongations(const BondSystem& bonds)
    : of_law_(bonds.laws().size()), all_bonds_(static_cast<Eigen::Index>(bonds.size())) {
  std::vector<double> times;
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    if (!(bonds.relaxing()[static_cast<Eigen::Index>(i)] > 0.0)) continue;
    const std::size_t number = bonds.law_of(i);
    const ViscousLaw& law = bonds.laws()[number];
    bonds_.push_back(i);
    of_law_[number] = {ones_.size(), law.branches.size()};
    for (const ViscousLaw::Branch& branch : law.branches) {
      ones_.push_back({i, branch.share});
      times.push_back(branch.relaxation_time_s);
    }
  }
  times_s_ = Vector::Map(times.data(), std::ssize(times));
}

void ViscousElongations::set_mean(const ConstVector& y, Vector& mean) const {
  mean.setZero(all_bonds_);
  Eigen::Index k = 0;
  for (const One& one : ones_) mean[static_cast<Eigen::Index>(one.bond)] += one.share * y[k++];
}

RelaxationFactor ViscousElongations::mean_relaxation_factor(
    const ConstVector& relaxation_factor) const {
  std::vector<double> means;
  for (const OfLaw& law : of_law_) {
    double mean = 0.0;
    for (std::size_t k = law.first; k < law.first + law.count; ++k) {
      mean += ones_[k].share * relaxation_factor[static_cast<Eigen::Index>(k)];
    }
    means.push_back(mean);
  }
  if (means.size() == 1) return means.front();
  return RelaxationFactor(std::move(means));
}

void ViscousElongations::spread(const Vector& of_bond, Vector& of_y) const {
  of_y.resize(size());
  Eigen::Index k = 0;
  for (const One& one : ones_) of_y[k++] = of_bond[static_cast<Eigen::Index>(one.bond)];
}

}  // namespace tpm::organ
