#include "tpm/organ/scene/place_function.hpp"

#include <fmt/format.h>
#include <muParser.h>

#include <numbers>

#include "tpmkit/error.hpp"

namespace tpm::organ {

struct PlaceFunction::Impl {
  mu::Parser parser;
  Eigen::Vector3d place = Eigen::Vector3d::Ones();
  std::string text, where;

  [[nodiscard]] Error broken(std::string why) const {
    while (!why.empty() && why.back() == '.') why.pop_back();
    return bad_input(where, fmt::format("formula '{}': {}", printable(text), why),
                     "a formula of x, y and z in metres");
  }
};

PlaceFunction::PlaceFunction(const std::string& text, std::string_view where)
    : impl_(std::make_unique<Impl>()) {
  impl_->text = text;
  impl_->where = where;
  try {
    impl_->parser.ClearConst();
    impl_->parser.DefineConst("pi", std::numbers::pi);
    impl_->parser.DefineVar("x", &impl_->place.x());
    impl_->parser.DefineVar("y", &impl_->place.y());
    impl_->parser.DefineVar("z", &impl_->place.z());
    impl_->parser.SetExpr(text);
    static_cast<void>(impl_->parser.Eval());
  } catch (const mu::ParserError& error) {
    throw impl_->broken(error.GetMsg());
  }
}

PlaceFunction::~PlaceFunction() = default;

double PlaceFunction::at(const Eigen::Vector3d& place_m) {
  impl_->place = place_m;
  try {
    return impl_->parser.Eval();
  } catch (const mu::ParserError& error) {
    throw impl_->broken(error.GetMsg());
  }
}

}  // namespace tpm::organ
