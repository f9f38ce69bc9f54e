#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "tpm/law/kernel.hpp"
#include "tpm/law/relaxation/exponential_quadrature.hpp"
#include "tpm/law/relaxation_sum.hpp"
#include "tpmkit/model.hpp"

namespace tpm::law {

/// Where the parameters that shape the kernel stand in the parameter vector; -1 if there is none.
struct KernelPlaces {
  int exponent = -1;
  int tension_share = -1;
  int k_tension = -1;
  int spacing = -1;
  int contact = -1;
  int offset = -1;
};

/// The most parameters of a law in parallel form.
inline constexpr int kMostLawParameters = 2 * kMostBranches + 8;

/// Derivatives by all parameters of a law, on the stack.
using Slopes = Eigen::Array<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMostLawParameters, 1>;

/// A law at given parameters, ready to be stepped through a history.
struct LawAtParameters {
  RelaxationSum relaxation;
  KernelShape kernel;
  TensionShape tension;
  double k_tension = 0.0;
  double contact = 0.0;
  double offset = 0.0;
  KernelPlaces place;
  int parameter_count = 0;
};

struct ContactEdge;

/// The contact of one law with a probe: the states of all branches, stepped exactly through pieces
/// on which the drive is linear, with derivatives by all parameters.
///
/// One-sided: the probe only pushes. Where the force would become negative the surface leaves the
/// probe and recovers under no force until the probe reaches it again.
class ContactHistory {
 public:
  /// @param peak_depth largest depth (or expected depth) of the history, for the tolerances
  ContactHistory(const LawAtParameters& law, double peak_depth, Want want);

  /// The drive (depth before subtraction of `contact`) was constant for ever.
  void rest_at_drive(double drive);
  /// An instantaneous change of the drive.
  void jump_to_drive(double drive);
  /// The drive moves linearly from `from` to `to` within h > 0.
  /// @param time_scale largest time of the history: steps that differ by its rounding are equal
  void move_drive(double from, double to, double h, double time_scale);

  /// The load (offset included) was constant for ever.
  void rest_at_load(double load);
  /// An instantaneous change of the load.
  void jump_to_load(double load);
  /// The load moves linearly within h > 0; adaptive steps, error 1e-10 of the depth's scale each.
  void move_load(double from, double to, double h, double time_scale);

  /// Contact force (offset included) and its derivatives by all parameters.
  [[nodiscard]] double force() const;
  [[nodiscard]] Slopes force_slopes() const;
  /// Drive that the surface answers (contact included) and its derivatives.
  [[nodiscard]] double drive() const { return now_.u + law_.contact; }
  [[nodiscard]] Slopes drive_slopes() const;
  /// Force (offset included) of a contact whose edge has drawn back to `edge`; the history is that
  /// up to edge.met_s.
  [[nodiscard]] double force_within(const ContactEdge& edge) const;
  [[nodiscard]] Slopes force_slopes_within(const ContactEdge& edge) const;

 private:
  /// A depth u of the surface, V(u), and their derivatives by all parameters.
  struct Point {
    double u = 0.0;
    double v = 0.0;
    Slopes u_by;
    Slopes v_by;
  };
  /// A V(u) + k_tension T(u) = load + R, what a surface under a given load must satisfy.
  struct Balance {
    double a = 0.0;
    double r = 0.0;
    Slopes a_by;
    Slopes r_by;
  };
  /// QuadratureWeights of all branches for one length of step.
  struct StepWeights {
    double h = -1.0;
    bool curved = false;
    Eigen::ArrayXd r;
    std::array<Eigen::ArrayXd, 5> b;
    std::vector<QuadratureWeights> each;
  };

  [[nodiscard]] Slopes zero_slopes() const;
  void carry_all_slopes();
  void relax_fully();
  /// @param touching at u = 0 the slope just inside the contact is meant, not just outside
  [[nodiscard]] Point imposed(double drive, bool touching) const;
  [[nodiscard]] double elastic_force(double v, double u, const Eigen::ArrayXd& w,
                                     double v_rate) const;
  void update_weights(double h, double time_scale, bool curved);
  void set_line_weights(double h);
  /// @param middle the three points within a curved step; empty for a straight one
  void step_branches(const Point& begin, std::span<const Point> middle, const Point& end);
  void accept(const Point& end, double v_rate, const Slopes& v_rate_by);
  void move_to_surface(const Point& surface, double h);
  [[nodiscard]] Slopes weighted_slopes(const Eigen::ArrayXd& weight) const;
  void move_one(double from, double to, double h, double time_scale);
  void move_smooth(double from, double to, double h, double time_scale, int level);
  void move_piece(double from, double to, double h, double time_scale, bool curved);
  [[nodiscard]] Balance instantaneous_balance() const;
  [[nodiscard]] Balance balance_over_step(double h) const;
  [[nodiscard]] Point surface_under(double load, const Balance& balance, bool loaded) const;
  /// The surface and its branches, between steps.
  struct Loaded {
    Eigen::ArrayXd w;
    Eigen::ArrayXXd w_by;
    Point now;
  };
  static constexpr int kMostHalvings = 60;
  static constexpr int kMostSteps = 6;  ///< one move is made in 1, 2, ..., 6 steps, then halved
  [[nodiscard]] std::array<double, kMostSteps> extrapolation(int n) const;
  void move_load_adaptive(double from, double to, double h, double time_scale, int level);
  [[nodiscard]] Loaded extrapolated(const std::vector<Loaded>& ends) const;
  [[nodiscard]] double distance(const Loaded& a, const Loaded& b) const;
  void load_step(double load, double h, double time_scale);

  const LawAtParameters& law_;
  bool want_slopes_;
  double v_tolerance_;
  Eigen::ArrayXd w_, w_next_;
  Eigen::ArrayXXd w_by_, w_by_next_;  ///< branches x carried_.size()
  /// The parameters that the states depend on: those of the kernel and the rates while the depth is
  /// imposed, all of them as soon as the surface finds its own depth.
  std::vector<int> carried_;
  Point now_;
  bool free_ = false;
  double v_rate_ = 0.0;  ///< dV/dt over the last step, for a dashpot
  Slopes v_rate_by_;
  StepWeights weights_;
};

}  // namespace tpm::law
