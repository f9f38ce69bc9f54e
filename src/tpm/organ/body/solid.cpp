// Declared in tpm/organ/body/filling.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/known_margins.hpp"
#include "tpm/organ/body/neighbours.hpp"
#include "tpm/organ/body/solid_support.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

using Eigen::Vector3d;

constexpr double kLeastDepth = 0.7;  // of lattice points, in spacings: clear of the outer layer
/// Deeper than a place below the surface and the spheres beside it, in spacings.
constexpr double kShallow = 2.0;

/// The points of a lattice that lie deep enough inside a surface, row by row along x. The distance
/// to the surface changes by at most a step per step, so most of a row is decided without asking.
class DeepPoints {
 public:
  DeepPoints(const Surface& surface, Lattice lattice, double spacing)
      : points_(lattice, spacing),
        least_(kLeastDepth * spacing),
        centre_(surface.bounds().center()) {
    const Vector3d half = 0.5 * surface.bounds().sizes() / points_.pitch();
    reach_ = half.array().ceil().cast<int>();
  }

  /// @param known of a surface that is asked again and again
  [[nodiscard]] std::size_t count(KnownMargins& known) const {
    std::size_t found = 0;
    rows([&](const Vector3d& point) { return known.margin(point, least_); },
         [&](const Vector3d&, std::size_t length, double) { found += length; });
    return found;
  }

  /// @param known of a surface whose points were counted
  /// @param depth of each, m, or less
  [[nodiscard]] Positions collect(KnownMargins& known, std::vector<double>& depth) const {
    std::vector<Vector3d> found;
    rows([&](const Vector3d& point) { return known.margin(point, least_); },
         [&](const Vector3d& first, std::size_t length, double margin) {
           for (std::size_t s = 0; s < length; ++s) {
             const double along = stride() * static_cast<double>(s);
             found.emplace_back(first.x() + along, first.y(), first.z());
             depth.push_back(margin + least_ - along);
           }
         });
    Positions points(3, static_cast<Eigen::Index>(found.size()));
    for (std::size_t i = 0; i < found.size(); ++i) {
      points.col(static_cast<Eigen::Index>(i)) = found[i];
    }
    return points;
  }

 private:
  [[nodiscard]] double stride() const { return points_.cell() * points_.pitch(); }

  /// Calls visit(first point, length, its margin) for stretches of deep points.
  /// @param margin_of how much deeper than necessary a point is, m, or less with the same sign
  template <class Margin, class Visit>
  void rows(const Margin& margin_of, const Visit& visit) const {
    for (int k = -reach_.z(); k <= reach_.z(); ++k) {
      for (int j = -reach_.y(); j <= reach_.y(); ++j) {
        int i = -reach_.x();
        if (!points_.holds(i, j, k) && !points_.holds(++i, j, k)) continue;  // an empty bcc row
        row(i, j, k, margin_of, visit);
      }
    }
  }

  template <class Margin, class Visit>
  void row(int first, int j, int k, const Margin& margin_of, const Visit& visit) const {
    const auto last = static_cast<std::size_t>((reach_.x() - first) / points_.cell());
    for (std::size_t s = 0; s <= last;) {
      const Vector3d point =
          centre_ +
          points_.pitch() * Vector3d(first + points_.cell() * static_cast<double>(s), j, k);
      const double margin = margin_of(point);
      const std::size_t alike =
          std::min(last + 1 - s, static_cast<std::size_t>(std::abs(margin) / stride()) + 1);
      // Rounding must not decide for a neighbour exactly a margin away.
      const std::size_t sure = alike > 1 ? alike - 1 : 1;
      if (margin >= 0.0) visit(point, sure, margin);
      s += sure;
    }
  }

  LatticePoints points_;
  double least_;
  Vector3d centre_;
  Eigen::Array3i reach_;
};

std::size_t total(const Surface& surface, Lattice lattice, double spacing, KnownMargins& known) {
  return even_count(surface, spacing) + DeepPoints(surface, lattice, spacing).count(known);
}

/// About the largest spacing that gives at least `count` spheres: bisection, ended early where the
/// surplus is below a thousandth.
double spacing_for(const Surface& surface, Lattice lattice, std::size_t count,
                   KnownMargins& known) {
  const auto wanted = static_cast<double>(count);
  double too_far = 1.01 * even_spacing(surface, 1);
  double enough = std::min(0.5 * too_far, 1.2 * std::cbrt(surface.volume() / wanted));
  for (int round = 0; round < 60 && too_far / enough > 1.0 + 1e-6; ++round) {
    const std::size_t found = total(surface, lattice, enough, known);
    if (found >= count) {
      if (static_cast<double>(found - count) <= 1e-3 * wanted) return enough;
      break;
    }
    too_far = enough;
    enough *= 0.95;
  }
  for (int round = 0; round < 20 && too_far / enough > 1.0 + 1e-6; ++round) {
    const double between = std::sqrt(enough * too_far);
    const std::size_t found = total(surface, lattice, between, known);
    (found >= count ? enough : too_far) = between;
    if (found >= count && static_cast<double>(found - count) <= 1e-3 * wanted) break;
  }
  return enough;
}

/// An inner sphere of the filling.
struct InnerSphere {
  Eigen::Index point = 0;  ///< of the lattice, those that were added after them
  Vector3d place;          ///< m
  Vector3d outwards;       ///< to the nearest point of the surface, m
  double depth = 0.0;      ///< m
  int layer = 0;
  bool settled = true;  ///< else the depth is at least this, and outwards is not known
};

/// @param near parts of the surface near the one before
InnerSphere inner_sphere(const Surface& surface, Eigen::Index point, const Vector3d& place,
                         NearParts& near) {
  constexpr double kAnywhere = std::numeric_limits<double>::infinity();
  InnerSphere sphere{point, place, surface.nearest_of_moved(place, kAnywhere, near) - place,
                     0.0,   0,     true};
  sphere.depth = sphere.outwards.norm();
  return sphere;
}

bool is_deeper(const InnerSphere& a, const InnerSphere& b) {
  return std::tuple(-a.depth, a.point) < std::tuple(-b.depth, b.point);
}

/// All points, the deepest first; how deep those beyond `shallow` lie is not asked yet.
/// @param least depth of each, m
std::vector<InnerSphere> by_depth(const Surface& surface, const Positions& points,
                                  const std::vector<double>& least, double shallow) {
  std::vector<InnerSphere> inner(static_cast<std::size_t>(points.cols()));
  NearParts near;
  for (std::size_t i = 0; i < inner.size(); ++i) {
    const auto point = static_cast<Eigen::Index>(i);
    inner[i] = least[i] > shallow
                   ? InnerSphere{point, points.col(point), Vector3d::Zero(), least[i], 0, false}
                   : inner_sphere(surface, point, points.col(point), near);
  }
  std::sort(inner.begin(), inner.end(), is_deeper);
  return inner;
}

/// The outer layer and what is inside it.
struct SolidFilling {
  double spacing = 0.0;
  Positions outer;
  Eigen::Matrix3Xd normal;         ///< of the outer layer
  std::vector<InnerSphere> inner;  ///< the deepest first
  Eigen::Index lattice_points = 0, next_point = 0;

  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(outer.cols()) + inner.size();
  }
};

/// Asks how deep the deep spheres lie, which only what is kept of a filling needs.
void settle(const Surface& surface, SolidFilling& filling) {
  NearParts near;
  // In the order of the lattice, in which each is near the one before.
  std::vector<InnerSphere*> open;
  for (InnerSphere& sphere : filling.inner) {
    if (!sphere.settled) open.push_back(&sphere);
  }
  std::sort(open.begin(), open.end(),
            [](const InnerSphere* a, const InnerSphere* b) { return a->point < b->point; });
  for (InnerSphere* sphere : open) {
    *sphere = inner_sphere(surface, sphere->point, sphere->place, near);
  }
  const auto end = std::find_if(
      filling.inner.begin(), filling.inner.end(),
      [&](const InnerSphere& sphere) { return sphere.point >= filling.lattice_points; });
  std::sort(filling.inner.begin(), end, is_deeper);
}

/// @param most spheres; the lattice's shallowest are left out
/// @param asked depth up to which spheres are asked how deep they lie, in spacings
SolidFilling lattice_filling(const Surface& surface, const SolidRequest& request, double spacing,
                             std::size_t most, KnownMargins& known, double asked) {
  SolidFilling filling;
  filling.spacing = spacing;
  std::vector<double> least;
  const Positions lattice = DeepPoints(surface, request.lattice, spacing).collect(known, least);
  const std::size_t all = even_count(surface, spacing) + static_cast<std::size_t>(lattice.cols());
  require_sphere_count(std::min(all, most));
  filling.outer =
      sorted_by_x(even_points(surface, std::min(even_count(surface, spacing), most), request.seed));
  filling.normal.resize(3, filling.outer.cols());
  for (Eigen::Index i = 0; i < filling.outer.cols(); ++i) {
    filling.normal.col(i) = surface.nearest(filling.outer.col(i)).normal;
  }
  filling.inner = by_depth(surface, lattice, least, (1.0 + 1e-9) * asked * spacing);
  filling.lattice_points = filling.next_point = lattice.cols();
  const auto outer = static_cast<std::size_t>(filling.outer.cols());
  if (const std::size_t room = most - outer; room < filling.inner.size()) {
    const auto cut = filling.inner.begin() + static_cast<std::ptrdiff_t>(room);
    if (!std::all_of(cut, filling.inner.end(), [](const InnerSphere& s) { return s.settled; })) {
      settle(surface, filling);
    }
    filling.inner.resize(room);
  }
  return filling;
}

/// The inner spheres that an outer one or a place below it may touch: the shallow ones, and deeper
/// ones of a filling that is not settled, which none of these touches.
Positions shallow(const SolidFilling& filling) {
  std::vector<Vector3d> found;
  for (const InnerSphere& sphere : filling.inner) {
    if (sphere.depth <= kShallow * filling.spacing) found.push_back(sphere.place);
  }
  Positions points(3, static_cast<Eigen::Index>(found.size()));
  for (std::size_t i = 0; i < found.size(); ++i) {
    points.col(static_cast<Eigen::Index>(i)) = found[i];
  }
  return points;
}

void add_inner(const Surface& surface, SolidFilling& filling, const Positions& added) {
  NearParts near;
  for (Eigen::Index i = 0; i < added.cols(); ++i) {
    filling.inner.push_back(inner_sphere(surface, filling.next_point++, added.col(i), near));
  }
}

/// Adds what the outer spheres lack.
/// @param wanted inner spheres within reach of each
std::size_t add_support(const Surface& surface, SolidFilling& filling, int wanted,
                        std::size_t most) {
  const Positions added = support_below(surface, filling.outer, filling.normal, shallow(filling),
                                        filling.spacing, wanted, most);
  add_inner(surface, filling, added);
  return static_cast<std::size_t>(added.cols());
}

/// Wanted neighbour below an outer sphere.
struct Wanted {
  std::size_t inside;
  double steadiness;
};

/// The outer spheres and the shallow ones that they touch.
class Held {
 public:
  Held(const SolidFilling& filling, const Positions& shallow)
      : filling_(filling),
        shallow_(shallow),
        below_(static_cast<std::size_t>(filling.outer.cols())) {
    above_.resize(static_cast<std::size_t>(shallow.cols()));
    Positions all(3, filling.outer.cols() + shallow.cols());
    all << filling.outer, shallow;
    const std::size_t outer = below_.size();
    for (const NeighbourPair& pair : pairs_within(all, kSolidReach * filling.spacing)) {
      if (pair.first >= outer || pair.second < outer) continue;
      below_[pair.first].push_back(pair.second - outer);
      above_[pair.second - outer].push_back(pair.first);
    }
  }

  /// True if every outer sphere still has what it wants without a shallow one.
  [[nodiscard]] bool can_spare(std::size_t place, const Wanted& wanted) const {
    return std::all_of(above_[place].begin(), above_[place].end(), [&](std::size_t outer) {
      if (below_[outer].size() <= wanted.inside) return false;
      std::vector<Vector3d> inner;
      for (const std::size_t other : below_[outer]) {
        if (other != place) {
          inner.emplace_back(shallow_.col(static_cast<Eigen::Index>(other)) -
                             filling_.outer.col(static_cast<Eigen::Index>(outer)));
        }
      }
      return steadiness(filling_.normal.col(static_cast<Eigen::Index>(outer)), inner) >=
             wanted.steadiness;
    });
  }

  void leave_out(std::size_t place) {
    for (const std::size_t outer : above_[place]) std::erase(below_[outer], place);
  }

 private:
  const SolidFilling& filling_;
  const Positions& shallow_;
  std::vector<std::vector<std::size_t>> below_, above_;
};

/// Leaves out lattice points, the shallowest first, without which every outer sphere still has
/// what it wants below it; where there are not so many the deepest that no outer sphere touches. A
/// thin body has none of those either: its outer spheres then make do with less.
void leave_out(SolidFilling& filling, std::size_t surplus) {
  if (surplus == 0) return;
  const Positions points = shallow(filling);
  Held held(filling, points);
  // shallow() keeps the order of the inner spheres, of which it takes the last of the lattice.
  std::vector<std::pair<std::size_t, std::size_t>> order;  // inner sphere, its number in `points`
  std::size_t number = 0;
  for (std::size_t i = 0; i < filling.inner.size(); ++i) {
    if (filling.inner[i].depth <= kShallow * filling.spacing) order.emplace_back(i, number++);
  }
  std::stable_sort(order.begin(), order.end(), [&](const auto& a, const auto& b) {
    return filling.inner[a.first].depth < filling.inner[b.first].depth;
  });
  std::vector<bool> out(filling.inner.size(), false);
  const auto leave = [&](std::size_t sphere) {
    out[sphere] = true;
    --surplus;
  };
  const auto leave_shallow = [&](const Wanted& wanted) {
    for (const auto& [sphere, place] : order) {
      if (surplus == 0) return;
      if (out[sphere] || !held.can_spare(place, wanted)) continue;
      held.leave_out(place);
      leave(sphere);
    }
  };
  const auto leave_deepest = [&](double deeper_than) {
    for (std::size_t i = 0; i < out.size() && surplus > 0; ++i) {
      if (!out[i] && filling.inner[i].depth > deeper_than) leave(i);
    }
  };
  leave_shallow({kWantedInside, kLeastSteadiness});
  leave_deepest(kShallow * filling.spacing);
  leave_shallow({2, 0.5 * kLeastSteadiness});
  leave_shallow({1, 0.0});
  leave_deepest(0.0);
  std::size_t at = 0;
  std::erase_if(filling.inner, [&](const InnerSphere&) { return out[at++]; });
}

/// Adds spheres where inner ones hold an outer sphere from one side alone, and leaves out as many
/// lattice points of a solid of a given number.
void steady(const Surface& surface, const SolidRequest& request, SolidFilling& filling) {
  const Positions added =
      steadying_below(surface, filling.outer, filling.normal, shallow(filling), filling.spacing);
  add_inner(surface, filling, added);
  if (request.count && filling.count() > *request.count) {
    leave_out(filling, filling.count() - *request.count);
  }
}

/// Layers one spacing thick below the outer one, without gaps, sorted.
void set_layers(double spacing, std::vector<InnerSphere>& inner) {
  for (InnerSphere& sphere : inner) {
    sphere.layer = 1 + static_cast<int>((sphere.depth - kLeastDepth * spacing) / spacing + 1e-9);
  }
  std::sort(inner.begin(), inner.end(), [](const InnerSphere& a, const InnerSphere& b) {
    return std::tuple(a.layer, a.point) < std::tuple(b.layer, b.point);
  });
  int found = 0;
  int before = 0;
  for (InnerSphere& sphere : inner) {
    if (sphere.layer != before) ++found;
    before = sphere.layer;
    sphere.layer = found;
  }
}

double decided_spacing(const Surface& surface, const SolidRequest& request, KnownMargins& known) {
  if (request.count.has_value() == request.spacing.has_value()) {
    throw bad_input("solid filling",
                    request.count ? "both a number of spheres and a spacing are given"
                                  : "neither a number of spheres nor a spacing is given",
                    "one of them");
  }
  if (request.count) {
    require_sphere_count(*request.count);
    return spacing_for(surface, request.lattice, *request.count, known);
  }
  if (!std::isfinite(*request.spacing) || !(*request.spacing > 0.0)) {
    throw bad_input("spacing", fmt::format("{} m", *request.spacing), "a length above 0");
  }
  // Before the lattice is walked: a slip in the unit would ask for billions of spheres.
  const double expected = surface.volume() / std::pow(*request.spacing, 3);
  if (expected > 2e6) {
    throw bad_input("spacing",
                    fmt::format("{} m gives about {:.3g} spheres", *request.spacing, expected),
                    "at most 1000000 spheres");
  }
  return *request.spacing;
}

void set_sphere(Organ& organ, Eigen::Index at, const Vector3d& position, const Vector3d& normal) {
  organ.position.col(at) = position;
  organ.normal.col(at) = normal;
}

/// Of a number of spheres, those that support the outer layer among them.
SolidFilling counted_filling(const Surface& surface, const SolidRequest& request,
                             SolidFilling first, std::size_t added, KnownMargins& known) {
  constexpr int kRounds = 3, kMostInside = 12;
  const std::size_t count = *request.count;
  std::size_t lattice = count - std::min(added, count / 2);
  SolidFilling filling;
  for (int round = 0; round < kRounds; ++round) {
    const double spacing = spacing_for(surface, request.lattice, lattice, known);
    filling = lattice_filling(surface, request, spacing, 2 * count, known, 0.0);
    add_support(surface, filling, kWantedInside, count);
    if (filling.count() >= count) break;
    lattice += count - filling.count() + count / 1000;  // the number of supports varies a little
  }
  for (int wanted = kWantedInside + 1; filling.count() < count && wanted < kMostInside; ++wanted) {
    add_support(surface, filling, wanted, count - filling.count());
  }
  if (filling.count() < count) filling = std::move(first);
  settle(surface, filling);
  leave_out(filling, filling.count() - count);
  return filling;
}

/// Throws unless three layers fit into the body where it is thickest.
void require_room(const Surface& surface, double spacing) {
  constexpr double kWholeNumber = 1e-6;  // of a thickness that is a whole number of spacings
  const double radius = inner_radius(surface, spacing);
  if (radius >= (1.0 - kInnerRadiusError - kWholeNumber) * spacing) return;
  throw bad_input("solid filling",
                  fmt::format("the body is about {:.3g} mm thick and the spheres {:.4g} mm apart",
                              2e3 * radius, 1e3 * spacing),
                  "three layers or more: smaller spheres, or a shell (\"filling\": \"shell\")");
}

}  // namespace

Organ fill_solid(const Surface& surface, const SolidRequest& request) {
  const auto about = static_cast<double>(request.count.value_or(1));
  KnownMargins known(surface, std::cbrt(surface.volume() / about));
  const double spacing = decided_spacing(surface, request, known);
  require_room(surface, spacing);
  const std::size_t most = request.count.value_or(std::numeric_limits<std::size_t>::max());
  SolidFilling filling = lattice_filling(surface, request, spacing, most, known, kShallow);
  if (const std::size_t added = add_support(surface, filling, kWantedInside, most);
      added > 0 && request.count) {
    filling = counted_filling(surface, request, std::move(filling), added, known);
  }
  settle(surface, filling);
  steady(surface, request, filling);
  require_sphere_count(filling.count());
  set_layers(filling.spacing, filling.inner);
  Organ organ;
  organ.position.resize(3, static_cast<Eigen::Index>(filling.count()));
  organ.normal.resize(3, organ.position.cols());
  Eigen::Index at = 0;
  for (; at < filling.outer.cols(); ++at) {
    set_sphere(organ, at, filling.outer.col(at), filling.normal.col(at));
    organ.layer.push_back(0);
  }
  for (const InnerSphere& sphere : filling.inner) {
    set_sphere(organ, at++, sphere.place, sphere.outwards.normalized());
    organ.layer.push_back(sphere.layer);
  }
  round_to_nanometres(organ.position);
  organ.name = fmt::format("solid filling of {} spheres", filling.count());
  organ.spacing = filling.spacing;
  organ.radius = request.radius.value_or(0.5 * filling.spacing);
  organ.assumptions.push_back(
      {"centres_on_surface", "the centres of the outer layer lie on the surface"});
  organ.assumptions.push_back(
      {"inside_lattice",
       fmt::format("the inside is a lattice ({})", entry_of(kLatticeWords, request.lattice).text)});
  const auto added = std::count_if(
      filling.inner.begin(), filling.inner.end(),
      [&](const InnerSphere& sphere) { return sphere.point >= filling.lattice_points; });
  if (added > 0) {
    organ.assumptions.push_back(
        {"supporting_spheres",
         fmt::format("{} spheres off the lattice support the outer layer where it has too few "
                     "below it",
                     added)});
  }
  require_valid(organ, organ.name);
  return organ;
}

}  // namespace tpm::organ
