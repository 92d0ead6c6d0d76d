/// \file
/// The properties, and how each is asked of a backend.
#include "oracle/checks/conform.hpp"
#include "oracle/checks/field_checks.hpp"
#include "oracle/solution/ensemble.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_file.hpp"
#include "tools/fuzz/campaign.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>

namespace decant::fuzz {
namespace {

/// The checks of `conform` that are properties as they are.
const std::set<std::string> checked = {"fields",      "substep",      "contact",     "advanced",   "trajectory", "mass",
                                       "containment", "conservation", "determinism", "invariance", "status"};

Outcome failed(const std::string& backend, const char* property, std::string reason) {
  return {backend, property, false, 0, "", std::move(reason)};
}

/// Those that run more than one substep.
constexpr std::array runs = {"advanced", "trajectory", "sequence", "mass", "containment", "determinism", "lists"};

/// Those that hold where every substep is what the oracle makes of the state before it: where fp32 cannot
/// tell to which of two faces a particle is pushed, runs part for good, and two may end in one corner.
const std::set<std::string> follow_from_steps = {"trajectory", "mass", "containment"};

/// The property's rows, joined to the worst.
Outcome joined(const std::string& backend, const std::string& property, const std::vector<CheckRow>& rows) {
  // `fields` gives rows of several names.
  Outcome o{backend, property, true, 0, "", ""};
  for (const CheckRow& row : rows) {
    // `run` says again what a check that was left says.
    const bool mine = property == "fields" ? !checked.contains(row.check) && row.check != "run" : row.check == property;
    if (!mine || is_left_out(row)) continue;
    const bool fails = verdict_of(row) != Verdict::pass;
    // More particles than usual may stand where fp32 cannot tell; that says nothing about a backend.
    if (fails && row.excluded > 0 && (row.n == 0 || row.score <= 1)) continue;
    if (fails && (o.holds || !(row.score <= o.score)))
      o.reason = fmt::format("{} {}: {}", row.check, row.field,
                             row.reason.empty() ? fmt::format("score {:.3g}", row.score) : row.reason);
    if (!(row.score <= o.score) || (fails && o.holds)) {
      o.score = row.score;
      o.field = row.check + (row.field.empty() ? "" : " " + row.field);
    }
    o.holds = o.holds && !fails;
  }
  return o;
}

/// The state after the first `substeps` of a run in parts. After a part either fields are evaluated or the
/// state is loaded anew, by turns, where the run is `interrupted`.
ParticleState state_after(Backend& backend, const Fixture& f, const Walls& walls, const std::vector<int>& parts,
                          bool interrupted, int substeps) {
  const auto advance = [&](int count) {
    if (const Status status = backend.advance(count); !status.ok()) throw BackendError(describe(status));
  };
  backend.load(f.scene, walls, f.state);
  ParticleState state = f.state;
  for (std::size_t k = 0; k < parts.size() && substeps > 0; ++k) {
    advance(std::min(parts[k], substeps));
    substeps -= parts[k];
    backend.read(state);
    if (!interrupted || substeps <= 0) continue;
    if (k % 2 == 0) {
      Fields fields = Fields::unwritten(f.state.size(), walls.size());
      if (const Status status = backend.evaluate(fields); !status.ok()) throw BackendError(describe(status));
    } else {
      backend.load(f.scene, walls, state);
    }
  }
  return state;
}

/// Whether every substep of a run is what the oracle makes of the state before it. Contact is a
/// discontinuity: a run may leave every bound and be right at each step.
bool each_step_holds(Backend& backend, const Fixture& f, const Walls& walls, const std::vector<int>& parts,
                     bool interrupted) {
  Fixture now = f;
  for (int k = 1; k <= run_substeps; ++k) {
    const PreparedReference oracle = prepare_reference(now, {"substep"});
    ParticleState next;
    try {
      next = state_after(backend, f, walls, parts, interrupted, k);
    } catch (const BackendError&) {
      return false;
    }
    RowBuilder builder(backend.info(), f.name);
    check_substep(next, all_answered(), now, oracle, builder);
    if (!joined("", "substep", builder.take()).holds) return false;
    now.state = next;
  }
  return true;
}

/// A run that left its bound holds where each of its steps does.
void hold_stepwise(Outcome& o, Backend& backend, const Fixture& f, const Walls& walls, const std::vector<int>& parts,
                   bool interrupted) {
  o.holds = o.stepwise = each_step_holds(backend, f, walls, parts, interrupted);
  if (o.holds) o.reason.clear();
}

/// Whether a run in unequal parts, with samples and loads in between, ends where one in one piece does, as
/// near as runs perturbed by rounding do.
Outcome sequence(Backend& backend, const std::string& name, const Fixture& f, const Walls& walls, std::uint64_t seed) {
  const int a = 1 + static_cast<int>(seed / 8 % 3), b = 1 + static_cast<int>(seed / 24 % 3);
  const std::vector<int> plan = {a, b, run_substeps - a - b};
  const ParticleState whole = state_after(backend, f, walls, {run_substeps}, false, run_substeps),
                      parts = state_after(backend, f, walls, plan, true, run_substeps);
  if (parts.substep != whole.substep)
    return failed(name, "sequence", fmt::format("at substep {} instead of {}", parts.substep, whole.substep));
  const Divergence apart = divergence(f.scene, parts, whole), bound = divergence_bound(f.ensemble);
  Outcome o{name, "sequence", true, 0, "", ""};
  for (std::size_t k = 0; k < apart.size(); ++k) {
    const double score = apart[k] == 0 ? 0 : apart[k] / bound[k];
    if (score <= o.score) continue;
    o.score = score;
    o.field = divergence_names[k];
  }
  if (o.score <= 1) return o;
  o.reason = fmt::format("{}: score {:.3g}", o.field, o.score);
  hold_stepwise(o, backend, f, walls, plan, true);
  return o;
}

/// Whether all are inside the domain, and not at its very end: what bursts out of it is trouble by right.
bool inside(const Scene& scene, const Eigen::Matrix3Xd& x) {
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    for (int a = 0; a < 3; ++a)
      if (!scene.domain.periodic[static_cast<std::size_t>(a)] &&
          !(x(a, i) > scene.domain.min[a] + scene.particle_spacing &&
            x(a, i) < scene.domain.max[a] - scene.particle_spacing))
        return false;
  return true;
}

/// Whether a list that says so misses no pair.
Outcome lists(Backend& backend, const std::string& name, const Fixture& f, const Walls& walls) {
  backend.load(f.scene, walls, f.state);
  const Status status = backend.advance(run_substeps);
  if (status.bits & Status::missed_pair) return failed(name, "lists", describe(status));
  const PairTotals counted = backend.neighbor_stats().verified;
  if (counted.missed + counted.wall_missed == 0) return {name, "lists", true, 0, "", ""};
  return failed(name, "lists", fmt::format("{} and {} of walls missed", counted.missed, counted.wall_missed));
}

/// Whether the scene comes back from its file as it was.
Outcome round_trip(const Scene& scene) {
  const std::string text = scene_to_json(scene);
  const Scene back = parse_scene(text, scene.name);
  check_scene(back, scene.name);
  if (scene_to_json(back) == text) return {"scene", "round-trip", true, 0, "", ""};
  return failed("scene", "round-trip", "another scene came back");
}

/// Every path to an object in a document.
void objects_in(const nlohmann::json& at, const nlohmann::json::json_pointer& path,
                std::vector<nlohmann::json::json_pointer>& found) {
  if (at.is_object()) found.push_back(path);
  if (at.is_object())
    for (const auto& [key, value] : at.items()) objects_in(value, path / key, found);
  else if (at.is_array())
    for (std::size_t k = 0; k < at.size(); ++k) objects_in(at[k], path / k, found);
}

/// Whether a scene with one thing wrong is refused and the key named: an unknown key, or a value of a
/// type that none has.
Outcome refusal(const Scene& scene, std::uint64_t seed) {
  nlohmann::json document = nlohmann::json::parse(scene_to_json(scene));
  std::vector<nlohmann::json::json_pointer> objects;
  objects_in(document, nlohmann::json::json_pointer(), objects);
  nlohmann::json& object = document[objects[seed / 4 % objects.size()]];
  std::string key = "surprise";
  if (seed % 4 > 0 && !object.empty()) {
    auto item = object.begin();
    std::advance(item, static_cast<std::ptrdiff_t>(seed / 7 % object.size()));
    key = item.key();
  }
  object[key] = nlohmann::json::object({{"surprise", nullptr}});
  try {
    (void)parse_scene(document.dump(), scene.name);
  } catch (const InputError& error) {
    if (error.key().find(key) != std::string::npos || error.key().find("surprise") != std::string::npos)
      return {"scene", "refusal", true, 0, "", ""};
    return failed("scene", "refusal", fmt::format("'{}' is wrong, '{}' was named", key, error.key()));
  }
  return failed("scene", "refusal", fmt::format("'{}' is wrong and nothing was said", key));
}

}  // namespace

const std::vector<Property>& properties() {
  static const std::vector<Property> all = {
      {"fields", "every field of every particle is the oracle's, within its tolerance", 1, true},
      {"substep", "one substep moves every particle as the oracle moves it", 1, true},
      {"contact", "walls push and rub as the oracle's do, whatever led to the contact", 4, true},
      {"advanced", "fields of what a run leaves in use are the oracle's at the state it ends in", 2, true},
      {"conservation", "forces between fluid particles sum to zero", 1, true},
      {"mass", "every particle is there once, finite, in one place", 4, true},
      {"containment", "no particle gets deeper into a wall than the oracle's own run shows", 4, true},
      {"determinism", "the same again gives the same bits", 4, true},
      {"invariance", "ids permuted, everything translated, everything rotated: the same answer", 4, true},
      {"trajectory", "a short run ends where the oracle's ends, as near as rounding lets runs end", 8, true},
      {"status", "errors that are provoked are reported, with particle and substep", 8, true},
      {"sequence", "parts of a run, reads and loads in between, end where one run ends", 8, true},
      {"lists", "a list that rebuilds by displacement misses no pair at any substep", 4, true},
      {"round-trip", "a scene comes back from its file as it was", 1, false},
      {"refusal", "a scene with one thing wrong is refused and the key named", 1, false},
  };
  return all;
}

Tester::Tester(std::vector<std::string> backends, std::set<std::string> properties, BackendMaker make, bool every_case)
    : names_(std::move(backends)),
      properties_(std::move(properties)),
      make_(std::move(make)),
      every_case_(every_case) {}

Backend& Tester::backend(const std::string& choice) {
  for (auto& [name, made] : made_)
    if (name == choice) return *made;
  return *made_.emplace_back(choice, make_(choice)).second;
}

std::vector<Outcome> Tester::test(const Fixture& drawn, std::uint64_t seed) {
  std::set<std::string> wanted;
  for (const Property& property : properties())
    if (properties_.contains(property.name) && (every_case_ || seed % static_cast<std::uint64_t>(property.every) == 0))
      wanted.insert(property.name);
  return outcomes(drawn, seed, {names_.begin(), names_.end()}, wanted);
}

Outcome Tester::test_one(const Case& fuzz_case, std::uint64_t seed, const Outcome& like) {
  for (Outcome& o :
       outcomes(fixture_of(fuzz_case, fmt::format("fuzz-{}", seed)), seed, {like.backend}, {like.property}))
    if (o.backend == like.backend && o.property == like.property) return o;
  return {like.backend, like.property, true, 0, "", ""};
}

std::vector<Outcome> Tester::outcomes(const Fixture& drawn, std::uint64_t seed, const std::set<std::string>& backends,
                                      const std::set<std::string>& asked) {
  std::vector<Outcome> all;
  std::set<std::string> wanted = asked;
  const auto ask = [&](const std::string& name, const char* property, const auto& question) {
    if (!wanted.contains(property)) return;
    try {
      all.push_back(question());
    } catch (const std::exception& error) {
      all.push_back(failed(name, property, error.what()));
    }
  };
  // Of the scene, whatever becomes of the state.
  ask("scene", "round-trip", [&] { return round_trip(drawn.scene); });
  ask("scene", "refusal", [&] { return refusal(drawn.scene, seed); });

  Fixture fixture = drawn;
  fixture.ensemble.substeps = run_substeps;
  const auto chosen_checks = [&] {
    CheckSelection checks;
    for (const auto& name : wanted)
      if (checked.contains(name)) checks.insert(name);
    return checks;
  };
  CheckSelection checks = chosen_checks();
  // Looks ahead: where the oracle's own run bursts out of the domain, nothing is asked of runs.
  if (wanted.contains("sequence") || wanted.contains("lists") || wanted.contains("advanced")) checks.insert("mass");
  const PreparedReference oracle = prepare_reference(fixture, checks);
  if (!ill_posed_reason(oracle.own).empty()) return {};
  const Scene& scene = fixture.scene;
  const ParticleState& state = fixture.state;
  if (oracle.later.size() == state.size() && !inside(scene, oracle.later.position))
    for (const char* name : runs) wanted.erase(name);
  const double dt = scene.time_step();
  if (!inside(scene, state.position + dt * (state.velocity + dt * oracle.own.fields.acceleration)))
    wanted.erase("substep");
  checks = chosen_checks();
  if (wanted.contains("trajectory") || wanted.contains("sequence"))
    fixture.ensemble = run_ensemble(scene, oracle.walls, state, run_substeps, run_members);
  for (const std::string& name : backends) {
    if (name == "scene") continue;
    if (!checks.empty()) {
      std::vector<CheckRow> rows;
      std::string trouble;
      try {
        rows = run_checks(backend(name), fixture, oracle, checks);
      } catch (const std::exception& error) {
        trouble = error.what();
      }
      for (const auto& property : checks) {
        Outcome o = trouble.empty() ? joined(name, property, rows) : failed(name, property.c_str(), trouble);
        if (follow_from_steps.contains(property) && !o.holds && trouble.empty())
          hold_stepwise(o, backend(name), fixture, oracle.walls, {run_substeps}, false);
        all.push_back(std::move(o));
      }
    }
    ask(name, "sequence", [&] { return sequence(backend(name), name, fixture, oracle.walls, seed); });
    if (name.starts_with("list") && name.find("rebuild=") == std::string::npos)
      ask(name, "lists", [&] { return lists(backend(name + ":check_completeness=on"), name, fixture, oracle.walls); });
  }
  return all;
}

}  // namespace decant::fuzz
