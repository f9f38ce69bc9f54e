#include "tpm/organ/scene/scene_keys.hpp"

namespace tpm::organ {

const Block<SceneKeys>& scene_block() {
  using K = SceneKeys;
  static const Block<K> block(
      "scene", "a piece of tissue, what fixes it, and what is done to it",
      {key("title", &K::title, text(), "what the scene is"),
       key("description", &K::description, text(), "what else is to be said of it"),
       required(key("organ", &K::organ, organ_kinds().type(), "the spheres")),
       key("bonds", &K::bonds, bonds_block().type(), "which spheres are joined"),
       key("material", &K::material, material_block().type(), "of the bonds"),
       key("anchors", &K::anchors, list(anchor_kinds().type()),
           "what is fixed; default: the far side of a liver, A, C and D of a star, else nothing"),
       key("sliders", &K::sliders, list(sphere_type()),
           "spheres that slide along their normal only; default: B of a star, else none"),
       key("loads", &K::loads, list(load_kinds().type(), {.fewest = 1, .most = 100}),
           "gravity and pressure, with which the tissue is in equilibrium at the start"),
       key("contacts", &K::contacts, list(contact_kinds().type(), {.fewest = 1, .most = 100}),
           "what meets the tissue; default: the organ's contact sphere is driven"),
       with_example(
           key("protocol", &K::protocol, contact_motion_kinds().type(),
               "what is done to the tissue; tpm simulate needs it, tpm network does not"),
           {{"kind", "ramp_hold"}, {"depth", "8 mm"}, {"rate", "4 mm/s"}, {"hold", "29 s"}}),
       key("formulation", &K::formulation, formulation_type(), "how the response is computed"),
       key("outputs", &K::outputs, outputs_block().type(), "when the whole network is written"),
       key("tolerance", &K::tolerance, number({.least = 1e-12, .most = 0.1}),
           "of the response, in parts of its largest value; default 1e-6, with masses 1e-5")});
  return block;
}

const FileKind& scene_kind() {
  static const FileKind kind{
      "scene", "A scene of tpm network and tpm simulate",
      "A piece of tissue, what fixes it, and what is done to it. Quantities are texts of a number "
      "and a unit, such as \"20 mm\". Spheres are numbered from 1",
      scene_block().form()};
  return kind;
}

}  // namespace tpm::organ
