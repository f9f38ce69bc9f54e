#include "tpm/organ/bonds/material_field.hpp"

#include "tpmkit/error.hpp"

namespace tpm::organ {

BondLaws::BondLaws(const Network& network, const MaterialField& field)
    : network_(network), field_(field) {
  for (const BondMaterial& material : field.materials) {
    require_valid(material, "material");
    if (material.lateral != field.lateral()) {
      throw bad_input("material", "regions whose lateral bonds pull by different rules",
                      "one rule for all lateral bonds");
    }
    radial_.push_back(material.radial_law());
    lateral_.push_back(material.lateral_law());
  }
}

const BondLaw& BondLaws::law_of(std::size_t material, BondKind kind) const {
  return kind == BondKind::radial ? radial_[material] : lateral_[material];
}

BondLaws::Found BondLaws::of(std::size_t bond) {
  const Bond& joined = network_.bonds[bond];
  const auto material = [&](std::uint32_t sphere) -> std::size_t {
    return field_.of_sphere.empty() ? 0 : field_.of_sphere[sphere];
  };
  const auto factor = [&](std::uint32_t sphere) {
    return field_.factor.size() == 0 ? 1.0 : field_.factor[sphere];
  };
  const std::size_t at_a = material(joined.a);
  const std::size_t at_b = material(joined.b);
  const double of_a = factor(joined.a);
  const double of_b = factor(joined.b);
  if (at_a == at_b) {
    const double mean =
        field_.between == BlendRule::mean ? 0.5 * (of_a + of_b) : 2.0 * of_a * of_b / (of_a + of_b);
    return {&law_of(at_a, joined.kind), of_a == of_b ? of_a : mean};
  }
  blend_ = blended(law_of(at_a, joined.kind).scaled(of_a), law_of(at_b, joined.kind).scaled(of_b),
                   field_.between, "material/between");
  return {&blend_, 1.0};
}

}  // namespace tpm::organ
