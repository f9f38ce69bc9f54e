// Organs written for physics engines: well-formed XML, every sphere, mass, anchor and bond, the
// contact's stiffness rebuilt from the text alone, and what is said to be missing.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <map>
#include <sstream>

#include "refusal.hpp"
#include "tpm/organ/balance/mass_spring.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpm/organ/scene/organ_export.hpp"

namespace tpm::organ {
namespace {

using Catch::Matchers::Contains;

/// A tag of a document: its name, attributes, and the tags that it stands in.
struct Tag {
  std::string name;
  std::map<std::string, std::string> attribute;
  std::size_t depth = 0;
};

/// A reader of the XML that the export uses: throws std::runtime_error for what is not well-formed.
std::vector<Tag> tags_of(const std::string& text) {
  std::vector<Tag> tags;
  std::vector<std::string> open;
  std::size_t at = 0;
  const auto require = [&](bool fine, const char* what) {
    if (!fine) throw std::runtime_error(std::string(what) + " at " + text.substr(at, 60));
  };
  while ((at = text.find('<', at)) != std::string::npos) {
    if (text.compare(at, 2, "<?") == 0) {
      at = text.find("?>", at) + 2;
      continue;
    }
    if (text.compare(at, 4, "<!--") == 0) {
      const std::size_t end = text.find("--", at + 4);
      require(end != std::string::npos && text.compare(end, 3, "-->") == 0, "comment");
      at = end + 3;
      continue;
    }
    std::size_t end = at;
    for (bool quoted = false; end < text.size() && (quoted || text[end] != '>'); ++end) {
      if (text[end] == '"') quoted = !quoted;
    }
    require(end < text.size(), "tag without an end");
    if (text[at + 1] == '/') {
      require(!open.empty() && text.substr(at + 2, end - at - 2) == open.back(), "closing tag");
      open.pop_back();
      at = end + 1;
      continue;
    }
    const bool closed = text[end - 1] == '/';
    std::string inside = text.substr(at + 1, end - at - 1 - (closed ? 1 : 0));
    Tag tag;
    tag.depth = open.size();
    const std::size_t space = inside.find_first_of(" \n");
    tag.name = inside.substr(0, space);
    std::size_t place = space;
    while (place != std::string::npos &&
           (place = inside.find_first_not_of(" \n", place)) != std::string::npos) {
      const std::size_t equals = inside.find("=\"", place);
      require(equals != std::string::npos, "attribute");
      const std::size_t quote = inside.find('"', equals + 2);
      require(quote != std::string::npos, "quote");
      const bool fresh = tag.attribute
                             .emplace(inside.substr(place, equals - place),
                                      inside.substr(equals + 2, quote - equals - 2))
                             .second;
      require(fresh, "attribute twice");
      place = quote + 1;
    }
    tags.push_back(tag);
    if (!closed) open.push_back(tag.name);
    at = end + 1;
  }
  require(open.empty(), "not closed");
  return tags;
}

std::vector<double> numbers_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<double> numbers;
  for (double each = 0.0; stream >> each;) numbers.push_back(each);
  REQUIRE(stream.eof());
  return numbers;
}

/// What an engine would build from the text.
struct Built {
  std::vector<Eigen::Vector3d> position;
  std::vector<double> mass;  ///< 0 of a held sphere
  std::vector<bool> held;
  std::vector<ExportedBond> springs;
};

Built built_from_sofa(const std::string& text) {
  Built built;
  double mass = 0.0;
  for (const Tag& tag : tags_of(text)) {
    if (tag.name == "MechanicalObject") {
      const auto p = numbers_of(tag.attribute.at("position"));
      for (std::size_t i = 0; i + 2 < p.size(); i += 3) {
        built.position.emplace_back(p[i], p[i + 1], p[i + 2]);
      }
      built.held.assign(built.position.size(), false);
    }
    if (tag.name == "UniformMass") mass = numbers_of(tag.attribute.at("vertexMass")).at(0);
    if (tag.name == "FixedProjectiveConstraint") {
      for (const double i : numbers_of(tag.attribute.at("indices"))) {
        built.held[static_cast<std::size_t>(i)] = true;
      }
    }
    if (tag.name == "StiffSpringForceField") {
      const auto s = numbers_of(tag.attribute.at("spring"));
      REQUIRE(s.size() % 5 == 0);
      for (std::size_t i = 0; i < s.size(); i += 5) {
        built.springs.push_back({static_cast<std::size_t>(s[i]), static_cast<std::size_t>(s[i + 1]),
                                 s[i + 2], s[i + 3], s[i + 4], false});
      }
    }
  }
  for (const bool held : built.held) built.mass.push_back(held ? 0.0 : mass);
  return built;
}

Built built_from_mjcf(const std::string& text) {
  Built built;
  std::string place;
  double mass = 0.0;
  std::map<std::string, std::size_t> site;
  std::vector<std::size_t> ends;
  for (const Tag& tag : tags_of(text)) {
    if (tag.name == "body") place = tag.attribute.at("pos");
    if (tag.name == "inertial") mass = numbers_of(tag.attribute.at("mass")).at(0);
    if (tag.name == "site" && tag.attribute.contains("name")) {
      const bool held = tag.attribute.contains("pos");
      const auto p = numbers_of(held ? tag.attribute.at("pos") : place);
      site.emplace(tag.attribute.at("name"), built.position.size());
      built.position.emplace_back(p[0], p[1], p[2]);
      built.held.push_back(held);
      built.mass.push_back(held ? 0.0 : mass);
    }
    if (tag.name == "spatial") {
      const auto length = numbers_of(tag.attribute.at("springlength"));
      built.springs.push_back({0, 0, numbers_of(tag.attribute.at("stiffness")).at(0),
                               numbers_of(tag.attribute.at("damping")).at(0), length.back(),
                               length.size() == 2});
      ends.clear();
    }
    if (tag.name == "site" && tag.attribute.contains("site")) {
      ends.push_back(site.at(tag.attribute.at("site")));
      if (ends.size() == 2) {
        built.springs.back().a = ends[0];
        built.springs.back().b = ends[1];
      }
    }
  }
  return built;
}

/// Force per depth of a sphere pushed along a direction while it may slide across it, from springs
/// at rest.
double stiffness_of(const Built& built, std::size_t pushed, const Eigen::Vector3d& direction) {
  const auto n = std::ssize(built.position);
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  for (const ExportedBond& s : built.springs) {
    const Eigen::Vector3d line = built.position[s.b] - built.position[s.a];
    CHECK(line.norm() == Approx(s.rest_length_m).epsilon(1e-12));
    const Eigen::Matrix3d block =
        s.stiffness_N_per_m * line.normalized() * line.normalized().transpose();
    const auto a = 3 * static_cast<Eigen::Index>(s.a), b = 3 * static_cast<Eigen::Index>(s.b);
    k.block<3, 3>(a, a) += block;
    k.block<3, 3>(b, b) += block;
    k.block<3, 3>(a, b) -= block;
    k.block<3, 3>(b, a) -= block;
  }
  std::vector<Eigen::Index> free;
  Eigen::VectorXd push = Eigen::VectorXd::Zero(3 * n);
  push.segment<3>(3 * static_cast<Eigen::Index>(pushed)) = direction;
  for (Eigen::Index i = 0; i < 3 * n; ++i) {
    if (!built.held[static_cast<std::size_t>(i / 3)]) free.push_back(i);
  }
  const Eigen::MatrixXd stiffness = k(free, free);
  const Eigen::VectorXd load = push(free);
  return 1.0 / load.dot(stiffness.ldlt().solve(load));
}

Json exported_scene() {
  return Json::parse(R"({"organ": {"kind": "liver", "count": 60, "spacing": "20 mm"},
    "bonds": {"lateral": "relaxing"}, "anchors": [{"kind": "far_side"}],
    "material": {"Einf": "2 kPa", "Eprime": "4 kPa",
                 "branches": [{"g": "1.5 kPa", "tau": "0.5 s"}, {"g": "0.5 kPa", "tau": "8 s"}]}})");
}

Tissue exported_tissue(const Json& scene = exported_scene()) {
  return parse_tissue(scene, "test", {});
}

Built built_from(const Tissue& tissue, const OrganExportOptions& options) {
  const std::string text = export_organ(tissue, options);
  return options.target == OrganTarget::sofa ? built_from_sofa(text) : built_from_mjcf(text);
}

}  // namespace

TEST_CASE("an engine builds the organ's contact from the exported text") {
  const Tissue tissue = exported_tissue();
  const Organ& organ = tissue.network.organ;
  const BondSystem bonds = tissue.bonds();
  const Probe probe{*organ.contact, -organ.normal.col(static_cast<Eigen::Index>(*organ.contact))};
  for (const OrganTarget target : {OrganTarget::sofa, OrganTarget::mjcf}) {
    for (const bool instantaneous : {false, true}) {
      CAPTURE(static_cast<int>(target), instantaneous);
      const Built built = built_from(
          tissue, {.target = target, .instantaneous = instantaneous, .density_kg_m3 = 900.0});
      REQUIRE(built.position.size() == organ.size());
      REQUIRE(built.springs.size() == bonds.size());
      double mass = 0.0, stiffness = 0.0, damping = 0.0;
      std::size_t held = 0;
      for (std::size_t i = 0; i < organ.size(); ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        CHECK((built.position[i] - organ.position.col(k)).norm() == 0.0);
        mass += built.mass[i];
        held += built.held[i] ? 1 : 0;
      }
      CHECK(held == tissue.anchors.size());
      CHECK(mass ==
            Approx(static_cast<double>(organ.size() - held) * sphere_masses_kg(organ, 900.0)[0]));
      for (const ExportedBond& s : built.springs) {
        stiffness += s.stiffness_N_per_m;
        damping += s.damping_N_s_per_m;
      }
      const double whole = bonds.stiffness().sum();
      // Half of each bond's stiffness relaxes; 3/4 of that within 0.5 s, the rest within 8 s.
      CHECK(stiffness == Approx(instantaneous ? whole : 0.5 * whole).epsilon(1e-12));
      CHECK(damping ==
            Approx(instantaneous ? 0.0 : 0.5 * whole * (0.75 * 0.5 + 0.25 * 8.0)).epsilon(1e-12));
      // Loads leave the sphere free across the push, and so does this.
      const double rebuilt = stiffness_of(built, probe.sphere, probe.direction);
      CHECK(rebuilt == Approx(contact_stiffness_N_per_m(bonds, organ.position, tissue.constraints(),
                                                        probe, instantaneous ? 0.0 : 1.0))
                           .epsilon(1e-9));
    }
  }
}

TEST_CASE("what an engine cannot say of an organ is said in the text and beside it") {
  Json scene = exported_scene();
  scene["material"]["potential"] = {{"shape", "cubic"}, {"stiffening", "5 mm"}};
  scene["title"] = "a <liver> & \"more\" -- of it";
  const Tissue tissue = exported_tissue(scene);
  for (const OrganTarget target : {OrganTarget::sofa, OrganTarget::mjcf}) {
    const OrganExportOptions options{.target = target, .source = "a--b.json"};
    const std::vector<Remark> remarks = organ_export_remarks(tissue, options);
    REQUIRE(remarks.size() == 2);
    CHECK(remarks[0].code == "relaxation_branches_as_damper");
    CHECK_THAT(remarks[0].text, Contains("2 times this one"));
    CHECK(remarks[1].code == "stiffening_left_out");
    const std::string text = export_organ(tissue, options);
    CHECK_NOTHROW(tags_of(text));
    for (const Remark& remark : remarks) CHECK_THAT(text, Contains(remark.text));
  }
  const std::vector<Remark> springs = organ_export_remarks(tissue, {.instantaneous = true});
  REQUIRE(springs.size() == 2);
  CHECK(springs[0].code == "relaxation_left_out");
}

TEST_CASE("ropes and sliders reach the engines that know them") {
  Json scene = exported_scene();
  scene["bonds"]["lateral"] = "rope";
  scene["material"].erase("branches");
  const std::size_t contact = *exported_tissue().network.organ.contact;
  scene["sliders"] = Json::array({contact + 1});
  const Tissue tissue = exported_tissue(scene);
  const Built mjcf = built_from(tissue, {.target = OrganTarget::mjcf});
  const BondSystem bonds = tissue.bonds();
  for (std::size_t i = 0; i < bonds.size(); ++i) CHECK(mjcf.springs[i].rope == bonds.is_rope(i));
  CHECK(organ_export_remarks(tissue, {.target = OrganTarget::mjcf}).empty());
  const auto of_sofa = organ_export_remarks(tissue, {.target = OrganTarget::sofa});
  REQUIRE(of_sofa.size() == 1);
  CHECK(of_sofa[0].code == "ropes_push");
  CHECK_THAT(export_organ(tissue, {.target = OrganTarget::sofa}),
             Contains("DirectionProjectiveConstraint indices=\"" + std::to_string(contact)));
  int slides = 0;
  for (const Tag& tag : tags_of(export_organ(tissue, {.target = OrganTarget::mjcf}))) {
    slides += tag.name == "joint" ? 1 : 0;
  }
  CHECK(slides == 3 * static_cast<int>(tissue.network.organ.size() - tissue.anchors.size()) - 2);
  CHECK_THAT(test::refusal_of([&] { (void)export_organ(tissue, {.density_kg_m3 = 0.0}); }),
             Contains("density 0 kg/m3"));
}

}  // namespace tpm::organ
