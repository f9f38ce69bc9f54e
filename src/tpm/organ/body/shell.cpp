// Declared in tpm/organ/body/filling.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/landing_site.hpp"
#include "tpm/organ/body/neighbours.hpp"
#include "tpm/work/parallel.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

using Eigen::Vector3d;

constexpr double kRoom = 0.8;            // share of the inner radius that the layers may take
constexpr double kClearance = 0.62;      // least distance of an inner sphere, in steps
constexpr double kAgreement = 0.01;      // of a count and a spacing that are both given
constexpr double kDepthRounding = 1e-9;  // of a depth
constexpr int kSweeps = 200;

/// A request with everything decided.
struct ShellPlan {
  std::size_t count = 0;
  int layers = 0;
  double spacing = 0.0;
  double step = 0.0;  ///< between layers, m

  /// Spheres of a layer.
  [[nodiscard]] std::size_t in_layer(int layer) const {
    const auto parts = static_cast<std::size_t>(layers);
    return count / parts + (static_cast<std::size_t>(layer) < count % parts ? 1 : 0);
  }
};

void require_spacing(double spacing) {
  if (std::isfinite(spacing) && spacing > 0.0) return;
  throw bad_input("spacing", fmt::format("{} m", spacing), "a length above 0");
}

/// The count that a request means.
std::size_t decided_count(const Surface& surface, const ShellRequest& request) {
  if (request.layers < 1 || request.layers > 100) {
    throw bad_input("layers", fmt::format("{}", request.layers), "1 to 100");
  }
  if (request.spacing) require_spacing(*request.spacing);
  if (request.count) return *request.count;
  if (!request.spacing) {
    throw bad_input("shell", "neither a number of spheres nor a spacing is given", "one of them");
  }
  return even_count(surface, *request.spacing) * static_cast<std::size_t>(request.layers);
}

/// Throws if spheres of one face would be nearer to those of the other than to each other wherever
/// they lie.
void require_thinner_spheres(const Surface& surface, double spacing) {
  const double thickness = 2.0 * inner_radius(surface, 0.5 * spacing);
  if (spacing <= thickness * (1.0 + kInnerRadiusError)) return;
  throw bad_input("spacing",
                  fmt::format("{:.4g} mm in a body about {:.3g} mm thick at most", 1e3 * spacing,
                              1e3 * thickness),
                  "a spacing of at most the thickness, so more spheres");
}

ShellPlan planned(const Surface& surface, const ShellRequest& request) {
  ShellPlan plan;
  plan.layers = request.layers;
  plan.count = decided_count(surface, request);
  require_sphere_count(plan.count);
  if (plan.count < static_cast<std::size_t>(plan.layers)) {
    throw bad_input("layers", fmt::format("{} layers of {} spheres", plan.layers, plan.count),
                    "at least one sphere a layer");
  }
  const double even = even_spacing(surface, plan.in_layer(0));
  plan.spacing = request.spacing.value_or(even);
  if (request.count && request.spacing && std::abs(plan.spacing / even - 1.0) > kAgreement) {
    throw bad_input("shell",
                    fmt::format("{} spheres in {} layers at a spacing of {:.6g} m do not fit a "
                                "surface of {:.6g} m^2",
                                plan.count, plan.layers, plan.spacing, surface.area()),
                    fmt::format("a spacing of {:.6g} m, or only one of the two", even));
  }
  require_thinner_spheres(surface, plan.spacing);
  plan.step = plan.spacing;
  if (plan.layers > 1) {
    const double room = plan.step * (plan.layers - 1) / kRoom;
    plan.step = std::min(plan.step, kRoom * inner_radius(surface, room) / (plan.layers - 1));
  }
  return plan;
}

/// Inner spheres closer than the clearance move aside, and stay at their depth or below it.
class InnerLayers {
 public:
  InnerLayers(const Surface& surface, const ShellPlan& plan, Organ& organ)
      : surface_(surface),
        organ_(organ),
        step_(plan.step),
        near_(kClearance * plan.step),
        fixed_(static_cast<Eigen::Index>(plan.in_layer(0))),
        seen_(organ.size()) {}

  void settle() {
    std::vector<Eigen::Index> moved(static_cast<std::size_t>(organ_.position.cols() - fixed_));
    std::iota(moved.begin(), moved.end(), fixed_);
    for (int sweep = 0; sweep < kSweeps && !moved.empty(); ++sweep) {
      for_each_in_parallel(moved.size(), [&](std::size_t i) { keep_depth(moved[i]); });
      moved = push_apart();
    }
  }

 private:
  void keep_depth(Eigen::Index i) {
    const double wanted = kClearance * step_ * organ_.layer[static_cast<std::size_t>(i)];
    // A step changes the depth by no more than its own length.
    Seen& seen = seen_[static_cast<std::size_t>(i)];
    const double sure = seen.depth - (organ_.position.col(i) - seen.position).norm();
    if (sure >= (1.0 + kDepthRounding) * wanted) return;
    const double depth = -surface_.signed_distance(organ_.position.col(i));
    seen = {organ_.position.col(i), depth};
    if (depth >= wanted) return;
    const SurfacePoint at = surface_.nearest(organ_.position.col(i));
    organ_.position.col(i) -= (wanted - depth) * at.normal;
  }

  std::vector<Eigen::Index> push_apart() {
    const double clearance = kClearance * step_;
    Positions push = Positions::Zero(3, organ_.position.cols());
    std::vector<bool> touched(organ_.size(), false);
    for (const NeighbourPair& pair : near_.of(organ_.position)) {
      const auto a = static_cast<Eigen::Index>(pair.first);
      const auto b = static_cast<Eigen::Index>(pair.second);
      if (b < fixed_) continue;  // both in the outer layer
      Vector3d apart = organ_.position.col(b) - organ_.position.col(a);
      double distance = apart.norm();
      if (distance > 0.999 * clearance) continue;
      if (!(distance > 0.0)) {  // two columns that end at one place part along their normals
        apart = organ_.normal.col(b) - organ_.normal.col(a);
        distance = std::max(apart.norm(), 1e-300);
      }
      const Vector3d lacking =
          ((clearance - (organ_.position.col(b) - organ_.position.col(a)).norm()) / distance) *
          apart;
      const double share = a < fixed_ ? 1.0 : 0.5;
      push.col(b) += share * lacking;
      touched[pair.second] = true;
      if (a < fixed_) continue;
      push.col(a) -= share * lacking;
      touched[pair.first] = true;
    }
    std::vector<Eigen::Index> moved;
    for (Eigen::Index i = fixed_; i < organ_.position.cols(); ++i) {
      if (!touched[static_cast<std::size_t>(i)]) continue;
      organ_.position.col(i) += 0.7 * push.col(i);
      moved.push_back(i);
    }
    return moved;
  }

  /// Where a sphere was when its depth was last found.
  struct Seen {
    Vector3d position = Vector3d::Zero();
    double depth = -std::numeric_limits<double>::infinity();
  };

  const Surface& surface_;
  Organ& organ_;
  double step_;
  NearPairs near_;
  Eigen::Index fixed_;
  std::vector<Seen> seen_;
};

/// The columns below the outer layer, straight down.
/// @param normal of the outer layer
Organ stacked(const ShellPlan& plan, const Positions& outer, const Eigen::Matrix3Xd& normal) {
  Organ organ;
  const auto count = static_cast<Eigen::Index>(plan.count);
  organ.position.resize(3, count);
  organ.normal.resize(3, count);
  Eigen::Index at = 0;
  for (int layer = 0; layer < plan.layers; ++layer) {
    for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(plan.in_layer(layer)); ++i, ++at) {
      organ.position.col(at) = outer.col(i) - layer * plan.step * normal.col(i);
      organ.normal.col(at) = normal.col(i);
      organ.layer.push_back(layer);
    }
  }
  return organ;
}

/// Of the first `count` places the one nearest to a point.
std::size_t nearest_of(const Positions& places, std::size_t count, const Vector3d& point) {
  Eigen::Index nearest = 0;
  (places.leftCols(static_cast<Eigen::Index>(count)).colwise() - point)
      .colwise()
      .squaredNorm()
      .minCoeff(&nearest);
  return static_cast<std::size_t>(nearest);
}

/// The outer layer in the order of its numbers, with its normals.
struct OuterLayer {
  Positions position;
  Eigen::Matrix3Xd normal;
  std::optional<std::size_t> contact;
  Remark assumption;  ///< about the contact
};

OuterLayer outer_layer(const Surface& surface, const ShellPlan& plan, const ShellRequest& request) {
  OuterLayer outer;
  outer.position = sorted_by_x(even_points(surface, plan.in_layer(0), request.seed));
  LandingSite site;
  if (request.landing) {
    // The contact has a partner in every layer.
    outer.contact = nearest_of(outer.position, plan.in_layer(plan.layers - 1), *request.landing);
    site = flatten_landing_site(surface, outer.position, *outer.contact, plan.spacing);
    outer.assumption =
        site.flat
            ? Remark{"flat_at_contact",
                     fmt::format("the outer layer is flat within {} spacings of the contact sphere",
                                 kLandingReach)}
            : Remark{"curved_at_contact",
                     "the outer layer is too curved around the contact sphere to be made flat "
                     "there"};
  }
  outer.normal.resize(3, outer.position.cols());
  for (Eigen::Index i = 0; i < outer.position.cols(); ++i) {
    outer.normal.col(i) = surface.nearest(outer.position.col(i)).normal;
  }
  if (outer.contact) outer.normal.col(static_cast<Eigen::Index>(*outer.contact)) = site.normal;
  return outer;
}

}  // namespace

double inner_radius(const Surface& surface, double enough) {
  constexpr int kGrid = 24;
  const Eigen::AlignedBox3d box = surface.bounds();
  double deepest = 0.0;
  const auto from_middle = [](int i) {  // 12, 11, 13, 10, ...
    return kGrid / 2 + (i % 2 == 0 ? i / 2 : -(i + 1) / 2);
  };
  for (int i = 0; i < kGrid * kGrid * kGrid && deepest < enough; ++i) {
    const int row = i / kGrid;
    const int plane = row / kGrid;
    const Vector3d share(from_middle(i % kGrid), from_middle(row % kGrid), from_middle(plane));
    const Vector3d point =
        box.min() + ((share.array() + 0.5) / kGrid * box.sizes().array()).matrix();
    deepest = std::max(deepest, -surface.signed_distance(point));
  }
  return deepest;
}

Organ fill_shell(const Surface& surface, const ShellRequest& request) {
  const ShellPlan plan = planned(surface, request);
  const OuterLayer outer = outer_layer(surface, plan, request);
  Organ organ = stacked(plan, outer.position, outer.normal);
  InnerLayers(surface, plan, organ).settle();
  round_to_nanometres(organ.position);
  organ.name = fmt::format("shell of {} spheres in {} layers", plan.count, plan.layers);
  organ.spacing = plan.spacing;
  organ.radius = request.radius.value_or(0.5 * plan.spacing);
  organ.contact = outer.contact;
  organ.assumptions.push_back(
      {"centres_on_surface", "the centres of the outer layer lie on the surface"});
  if (outer.contact) organ.assumptions.push_back(outer.assumption);
  if (plan.layers > 1) {
    organ.assumptions.push_back({"layers_even", "the spheres are split evenly over the layers"});
    organ.assumptions.push_back(
        {"layer_distance", fmt::format("the layers are {:.4g} mm apart, {:.3g} spacings",
                                       plan.step * 1e3, plan.step / plan.spacing)});
  }
  require_valid(organ, organ.name);
  return organ;
}

}  // namespace tpm::organ
