/// \file
/// The schema walked for its leaves, canonical scenes walked for what they have there.
#include "tests/scene_coverage.hpp"

#include "oracle/files/fixture_file.hpp"
#include "reference/distance.hpp"
#include "reference/pose.hpp"
#include "reference/scene_file.hpp"
#include "reference/shapes.hpp"
#include "tools/fuzz/case.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <functional>

namespace decant::test {
namespace {

using nlohmann::json;

void find_leaves(const json& schema, const json& at, const std::string& path, std::set<std::string>& found) {
  if (at.contains("$ref")) {
    const std::string name = at["$ref"].get<std::string>().substr(std::string("#/$defs/").size());
    find_leaves(schema, schema["$defs"][name], path, found);
  } else if (at.contains("properties")) {
    for (const auto& [key, value] : at["properties"].items())
      find_leaves(schema, value, path.empty() ? key : path + "." + key, found);
  } else if (at.contains("items") && (at["items"].contains("$ref") || at["items"].contains("properties"))) {
    find_leaves(schema, at["items"], path + "[]", found);
  } else {
    found.insert(path);
  }
}

void find_values(const json& at, const std::string& path, const std::set<std::string>& keys,
                 std::map<std::string, std::set<std::string>>& found) {
  if (keys.contains(path)) {
    found[path].insert(at.dump());
  } else if (at.is_object()) {
    for (const auto& [key, value] : at.items()) find_values(value, path.empty() ? key : path + "." + key, keys, found);
  } else if (at.is_array()) {
    for (const json& item : at) find_values(item, path + "[]", keys, found);
  } else {
    found["a key of the canonical text that the schema lacks: " + path].insert(at.dump());
  }
}

bool any_container(const Fixture& f, const std::function<bool(const Container&)>& holds) {
  return std::any_of(f.scene.containers.begin(), f.scene.containers.end(), holds);
}

bool any_tilt(const Fixture& f, const std::function<bool(const Tilt&)>& holds) {
  return any_container(f, [&](const Container& c) { return c.tilt && holds(*c.tilt); });
}

const RevolvedShape* revolved(const Container& c) { return std::get_if<RevolvedShape>(&c.shape); }

double rate_now(const Fixture& f, const Tilt& tilt) { return tilt_at(tilt, f.scene.time_at(f.state.substep)).rate; }

/// Whether the third key decides how the tilt goes on at the state's time.
bool third_key_counts(const Fixture& f, const Tilt& tilt) {
  if (tilt.keys.size() < 3) return false;
  Tilt without = tilt;
  without.keys.erase(without.keys.begin() + 2);
  const double now = f.scene.time_at(f.state.substep);
  return tilt_at(without, now).angle != tilt_at(tilt, now).angle;
}

int bodies_in_reach(const Fixture& f, Eigen::Index i, bool& floor) {
  const double reach = std::max(f.scene.contact_distance(), 0.25 * f.scene.particle_spacing);
  int bodies = 0;
  for (const Container& c : f.scene.containers) {
    const Pose pose = pose_at(c, f.scene.time_at(f.state.substep));
    const SolidDistance solid(c);
    const Vec3 local = pose.to_local(Vec3(f.state.position.col(i)));
    bodies += solid.may_be_within(reach, local) && solid.at(local).distance < reach;
  }
  floor = f.scene.floor && f.state.position(2, i) - f.scene.floor->height < reach;
  return bodies;
}

int periods(const Fixture& f) {
  std::set<double> lengths;
  for (Eigen::Index a = 0; a < 3; ++a)
    if (f.scene.domain.periodic[static_cast<std::size_t>(a)])
      lengths.insert(f.scene.domain.max[a] - f.scene.domain.min[a]);
  return static_cast<int>(lengths.size());
}

/// What is not there is "-".
std::string names(const std::set<std::string>& all, std::size_t most) {
  std::string text;
  std::size_t k = 0;
  for (const auto& name : all) {
    if (k++ == most) return text + fmt::format(", … ({})", all.size());
    text += (text.empty() ? "" : ", ") + name;
  }
  return text.empty() ? "-" : text;
}

std::string shortened(const std::string& text) { return text.size() <= 60 ? text : text.substr(0, 57) + "…"; }

}  // namespace

std::set<std::string> leaf_keys(const json& schema) {
  std::set<std::string> found;
  find_leaves(schema, schema, "", found);
  return found;
}

std::set<std::string> leaf_keys_of_scenes() {
  std::ifstream in(DECANT_SOURCE_DIR "/fixtures/scenes/scene.schema.json");
  return leaf_keys(json::parse(in));
}

const std::map<std::string, std::string>& keys_without_influence() {
  static const std::map<std::string, std::string> all = [] {
    std::map<std::string, std::string> keys = {
        {"$schema", "for editors"},
        {"decant_scene", "version of the format"},
        {"name", "output files carry it"},
        {"containers[].name", "fills refer to it"},
        {"containers[].tilt.keys[].angle_deg", "read as angle"},
        {"containers[].revolved.wall_thickness", "checked against H; the outline says where the solid is"},
        {"containers[].boxes.wall_thickness", "checked against H; the boxes say where the solid is"},
        {"time.courant", "substeps_per_frame follows from it"},
        {"time.max_speed", "substeps_per_frame follows from it"},
        {"time.substeps_derived", "says who chose substeps_per_frame"},
    };
    for (const std::string& key : leaf_keys_of_scenes()) {
      if (key.starts_with("containers[].cup.")) keys[key] = "read as revolved";
      if (key.starts_with("containers[].tank.")) keys[key] = "read as boxes";
      if (key.starts_with("fill[].")) keys[key] = "where fluid is at the start; problems hold a state";
    }
    return keys;
  }();
  return all;
}

const std::vector<Aspect>& aspects() {
  static const std::vector<Aspect> all = {
      {"mass ratio other than 1", [](const Fixture& f) { return f.scene.mass_ratio != 1; }},
      {"support ratio other than 2", [](const Fixture& f) { return f.scene.support_ratio != 2; }},
      {"wall viscosity not twice the viscosity",
       [](const Fixture& f) { return f.scene.fluid.wall_viscosity != 2 * f.scene.fluid.viscosity; }},
      {"contact distance other than dx/4", [](const Fixture& f) { return f.scene.contact.distance_ratio != 0.25; }},
      {"gamma = 1 without tension",
       [](const Fixture& f) { return f.scene.fluid.eos_exponent == 1 && !f.scene.fluid.allow_tension; }},
      {"gamma = 7 with tension",
       [](const Fixture& f) { return f.scene.fluid.eos_exponent == 7 && f.scene.fluid.allow_tension; }},
      {"gravity not along -z",
       [](const Fixture& f) { return f.scene.gravity.head<2>().norm() > 0 || f.scene.gravity.z() >= 0; }},
      {"periods of different length", [](const Fixture& f) { return periods(f) > 1; }},
      {"several containers", [](const Fixture& f) { return f.scene.containers.size() > 1; }},
      {"more than two containers", [](const Fixture& f) { return f.scene.containers.size() > 2; }},
      {"surface that runs across two axes",
       [](const Fixture& f) {
         return any_container(f, [](const Container& c) { return (c.surface_velocity.array() != 0).count() > 1; });
       }},
      {"revolved shape with slanted edges",
       [](const Fixture& f) {
         return any_container(f, [](const Container& c) {
           if (!revolved(c)) return false;
           const auto edges = surface_edges(*revolved(c));
           return std::any_of(edges.begin(), edges.end(),
                              [](const ProfileEdge& e) { return e.r0 != e.r1 && e.z0 != e.z1; });
         });
       }},
      {"revolved shape open on its axis",
       [](const Fixture& f) {
         return any_container(f, [](const Container& c) {
           if (!revolved(c)) return false;
           const auto& p = revolved(c)->profile;
           return std::none_of(p.begin(), p.end(), [](const auto& point) { return point[0] == 0; });
         });
       }},
      {"box that turns",
       [](const Fixture& f) {
         return any_container(f,
                              [&](const Container& c) { return !revolved(c) && c.tilt && rate_now(f, *c.tilt) != 0; });
       }},
      {"revolved shape that turns",
       [](const Fixture& f) {
         return any_container(f,
                              [&](const Container& c) { return revolved(c) && c.tilt && rate_now(f, *c.tilt) != 0; });
       }},
      {"tilt whose third key decides where the container is",
       [](const Fixture& f) { return any_tilt(f, [&](const Tilt& t) { return third_key_counts(f, t); }); }},
      {"tilt with a pause",
       [](const Fixture& f) {
         return any_tilt(f, [](const Tilt& t) {
           for (std::size_t k = 1; k < t.keys.size(); ++k)
             if (t.keys[k].angle == t.keys[k - 1].angle) return true;
           return false;
         });
       }},
      {"tilt that turns back",
       [](const Fixture& f) {
         return any_tilt(f, [](const Tilt& t) {
           for (std::size_t k = 2; k < t.keys.size(); ++k)
             if ((t.keys[k].angle - t.keys[k - 1].angle) * (t.keys[1].angle - t.keys[0].angle) < 0) return true;
           return false;
         });
       }},
      {"tilt that goes on after its keys",
       [](const Fixture& f) {
         const double now = f.scene.time_at(f.state.substep);
         return any_tilt(f, [&](const Tilt& t) { return t.rate != 0 && now > t.keys.back().time; });
       }},
      {"tilt that oscillates",
       [](const Fixture& f) { return any_tilt(f, [](const Tilt& t) { return t.oscillation.has_value(); }); }},
      {"container that translates",
       [](const Fixture& f) {
         return any_container(f, [&](const Container& c) {
           return pose_at(c, f.scene.time_at(f.state.substep)).linear_velocity.norm() > 0;
         });
       }},
      {"tilt about no axis of the world",
       [](const Fixture& f) { return any_tilt(f, [](const Tilt& t) { return t.axis.cwiseAbs().maxCoeff() < 1; }); }},
      {"particle at a wall",
       [](const Fixture& f) {
         bool floor = false;
         for (Eigen::Index i = 0; i < f.state.size(); ++i)
           if (bodies_in_reach(f, i, floor) > 0) return true;
         return false;
       }},
      {"particle between a wall and the floor",
       [](const Fixture& f) {
         bool floor = false;
         if (!f.scene.floor) return false;
         for (Eigen::Index i = 0; i < f.state.size(); ++i)
           if (bodies_in_reach(f, i, floor) > 0 && floor) return true;
         return false;
       }},
  };
  return all;
}

void Coverage::add(const std::set<std::string>& keys, const Fixture& problem) {
  std::map<std::string, std::set<std::string>> found;
  find_values(json::parse(scene_to_json(problem.scene)), "", keys, found);
  for (const std::string& key : keys)
    if (!found.contains(key)) found[key].insert("-");
  for (const auto& [key, all] : found)
    for (const std::string& value : all) values[key][value].insert(problem.name);
  for (const Aspect& aspect : decant::test::aspects())
    if (aspect.holds(problem)) aspects[aspect.name].insert(problem.name);
  problems.insert(problem.name);
}

std::vector<std::string> Coverage::gaps(const std::set<std::string>& keys) const {
  std::vector<std::string> missing;
  for (const auto& [key, by_value] : values)
    if (!keys.contains(key)) missing.push_back(key);
  for (const std::string& key : keys) {
    if (keys_without_influence().contains(key)) continue;
    const auto found = values.find(key);
    if (found == values.end()) missing.push_back(key + ": in none");
    else if (found->second.size() < 2)
      missing.push_back(fmt::format("{}: {} alone", key, found->second.begin()->first));
  }
  for (const Aspect& aspect : decant::test::aspects()) {
    const auto found = aspects.find(aspect.name);
    if (found == aspects.end()) missing.push_back(std::string(aspect.name) + ": in none");
    else if (found->second.size() == problems.size()) missing.push_back(std::string(aspect.name) + ": in all");
  }
  return missing;
}

Coverage coverage_of_fixtures() {
  Coverage coverage;
  const auto keys = leaf_keys_of_scenes();
  for (const auto& entry : std::filesystem::directory_iterator(DECANT_SOURCE_DIR "/fixtures"))
    if (entry.path().extension() == ".h5") coverage.add(keys, read_fixture(entry.path()));
  return coverage;
}

Coverage coverage_of_fuzzing(int problems) {
  Coverage coverage;
  const auto keys = leaf_keys_of_scenes();
  for (int seed = 1; seed <= problems; ++seed)
    coverage.add(keys,
                 fuzz::fixture_of(fuzz::random_case(static_cast<std::uint64_t>(seed)), fmt::format("fuzz-{}", seed)));
  return coverage;
}

std::string coverage_table(const Coverage& fixtures, const Coverage& fuzzing) {
  std::string text = fmt::format(
      "What {} recordings and {} fuzzed problems vary of a scene. Made by: decant_studies coverage\n\n"
      "Keys, their values (-: not there), and the recordings that have them.\n",
      fixtures.problems.size(), fuzzing.problems.size());
  for (const std::string& key : leaf_keys_of_scenes()) {
    if (const auto exempt = keys_without_influence().find(key); exempt != keys_without_influence().end()) {
      text += fmt::format("\n{}\n  does not change the answer: {}\n", key, exempt->second);
      continue;
    }
    text += "\n" + key + "\n";
    std::size_t shown = 0;
    const auto& by_value = fixtures.values.at(key);
    for (const auto& [value, who] : by_value) {
      if (++shown > 8) {
        text += fmt::format("  … {} values\n", by_value.size());
        break;
      }
      text += fmt::format("  {:<24} {}\n", shortened(value), names(who, 4));
    }
    text += fmt::format("  fuzz: {} values\n", fuzzing.values.at(key).size());
  }
  text += fmt::format("\n{:<54} {:>10} {:>8}  {}\n", "Aspects", "recordings", "fuzz", "recordings");
  for (const Aspect& aspect : aspects()) {
    const auto who = [&](const Coverage& c) {
      const auto found = c.aspects.find(aspect.name);
      return found == c.aspects.end() ? std::set<std::string>{} : found->second;
    };
    text += fmt::format("{:<54} {:>10} {:>6.1f} %  {}\n", aspect.name, who(fixtures).size(),
                        100.0 * static_cast<double>(who(fuzzing).size()) / static_cast<double>(fuzzing.problems.size()),
                        names(who(fixtures), 4));
  }
  return text;
}

}  // namespace decant::test
