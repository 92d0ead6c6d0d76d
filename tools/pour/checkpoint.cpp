/// \file
/// Writes, reads and compares checkpoints.
#include "tools/pour/checkpoint.hpp"

#include "oracle/files/hdf5_io.hpp"
#include "oracle/solution/digest.hpp"
#include "oracle/solution/fixture.hpp"
#include "reference/error.hpp"
#include "reference/scene_file.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace decant::pour {
namespace {

/// "time.frames" of "/time/frames".
std::string key_of(std::string pointer) {
  std::replace(pointer.begin(), pointer.end(), '/', '.');
  return pointer.empty() ? "scene" : pointer.substr(1);
}

std::string value_at(const nlohmann::json& json, const std::string& pointer) {
  const nlohmann::json::json_pointer at(pointer);
  return json.contains(at) ? json.at(at).dump() : "nothing";
}

void write_part(Hdf5Writer& out, const PartOfFrame& part) {
  out.matrix3("/part/looked_at", part.looked_at, "m", "particle, x y z, when walls were last looked at");
  out.attribute("/part", "looked_at_substep", part.looked_at_substep);
  out.attribute("/part", "solver_seconds", part.solver_seconds);
  const AuditResult& audit = part.on_the_way;
  out.attribute("/part", "deepest", audit.deepest);
  out.attribute("/part", "deepest_particle", audit.deepest_particle);
  out.attribute("/part", "inside", audit.inside);
  out.attribute("/part", "crossed", audit.crossed);
  out.attribute("/part", "first_crossed", audit.first_crossed);
  out.attribute("/part", "max_speed", audit.max_speed);
  out.attribute("/part", "fastest_particle", part.fastest_particle);
}

PartOfFrame read_part(const Hdf5Reader& in, std::int64_t particles) {
  const auto integer = [&](const char* name) { return in.integer_attribute("/part", name); };
  PartOfFrame part;
  part.looked_at = in.matrix3("/part/looked_at", particles);
  part.looked_at_substep = integer("looked_at_substep");
  part.solver_seconds = in.real_attribute("/part", "solver_seconds");
  AuditResult& audit = part.on_the_way;
  audit.deepest = in.real_attribute("/part", "deepest");
  audit.deepest_particle = integer("deepest_particle");
  audit.inside = integer("inside");
  audit.crossed = integer("crossed");
  audit.first_crossed = integer("first_crossed");
  audit.max_speed = in.real_attribute("/part", "max_speed");
  part.fastest_particle = integer("fastest_particle");
  return part;
}

}  // namespace

void write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint) {
  Hdf5Writer out(file, 1);  // the pour waits for it
  out.attribute("/", "schema", checkpoint_schema);
  out.attribute("/", "frame", checkpoint.frame);
  out.attribute("/", "substep", checkpoint.state.substep);
  out.attribute("/", "csv", checkpoint.choices.csv ? 1 : 0);
  out.attribute("/", "perturbation", std::int64_t{checkpoint.choices.perturbation});
  out.attribute("/", "wall_seconds", checkpoint.wall_seconds);
  out.attribute("/", "scene_sha256", sha256_of_text(checkpoint.scene_json));
  out.attribute("/", "backend", checkpoint.backend.name);
  out.attribute("/", "options", checkpoint.backend.options);
  out.attribute("/", "executor", checkpoint.backend.executor);
  out.attribute("/", "device", checkpoint.backend.device);
  out.attribute("/", "precision", checkpoint.backend.precision);
  out.text("/scene", checkpoint.scene_json, "canonical JSON");
  out.matrix3("/state/position", checkpoint.state.position, "m", "particle, x y z");
  out.matrix3("/state/velocity", checkpoint.state.velocity, "m/s", "particle, x y z");
  checkpoint.timeline.write(out, "/timeline");
  if (checkpoint.part) write_part(out, *checkpoint.part);
  out.commit();
}

Checkpoint read_checkpoint(const std::filesystem::path& file) {
  const Hdf5Reader in(file);
  const std::int64_t schema = in.integer_attribute("/", "schema");
  if (schema != checkpoint_schema)
    in.fail("schema", std::to_string(schema), fmt::format("must be {}", checkpoint_schema));
  Checkpoint c;
  c.frame = in.integer_attribute("/", "frame");
  c.choices.csv = in.integer_attribute("/", "csv") != 0;
  c.choices.perturbation = static_cast<std::uint32_t>(in.integer_attribute("/", "perturbation"));
  c.wall_seconds = in.real_attribute("/", "wall_seconds");
  c.scene_json = in.text("/scene");
  c.backend = {in.text_attribute("/", "backend"), in.text_attribute("/", "options"), in.text_attribute("/", "executor"),
               in.text_attribute("/", "device"), in.text_attribute("/", "precision")};
  c.state.substep = in.integer_attribute("/", "substep");
  c.state.position = in.matrix3("/state/position");
  c.state.velocity = in.matrix3("/state/velocity", c.state.size());
  c.timeline = Timeline::read(in, "/timeline");
  const std::string sha = in.text_attribute("/", "scene_sha256");
  if (sha != sha256_of_text(c.scene_json)) in.fail("scene_sha256", sha, "must be the digest of /scene");
  if (static_cast<std::int64_t>(c.timeline.rows.size()) != c.frame + 1)
    in.fail("/timeline/time", fmt::format("{} rows", c.timeline.rows.size()), fmt::format("must have {}", c.frame + 1));
  if (in.has("/part/looked_at")) c.part = read_part(in, c.state.size());
  return c;
}

namespace {

/// Options of a backend but for the number of its ranks, which may be another one for each part of a pour.
std::string without_ranks(const std::string& options) {
  std::string kept;
  for (std::size_t at = 0; at < options.size();) {
    const std::size_t end = std::min(options.find(':', at), options.size());
    const std::string item = options.substr(at, end - at);
    if (!item.starts_with("ranks=")) kept += (kept.empty() ? "" : ":") + item;
    at = end + 1;
  }
  return kept;
}

}  // namespace

void check_same_pour(const std::filesystem::path& file, const Checkpoint& checkpoint, const Scene& scene,
                     const BackendInfo& backend, const Choices& choices) {
  const auto refuse = [&](const std::string& key, const std::string& now, const std::string& then) {
    throw InputError(file.string(), key, now, "the pour to resume was started with " + then);
  };
  const std::string json = scene_to_json(scene);
  if (json != checkpoint.scene_json) {
    const auto now = nlohmann::json::parse(json), then = nlohmann::json::parse(checkpoint.scene_json);
    const auto difference = nlohmann::json::diff(then, now);
    // The frames decide the substep too; whoever changed them wants to read about them.
    std::string pointer = difference.empty() ? "" : difference.front().at("path").get<std::string>();
    for (const auto& change : difference)
      if (change.at("path") == "/time/frames") pointer = "/time/frames";
    refuse(key_of(pointer), value_at(now, pointer), value_at(then, pointer));
  }
  const BackendInfo& then = checkpoint.backend;
  if (backend.name != then.name) refuse("--backend", backend.name, then.name);
  if (without_ranks(backend.options) != without_ranks(then.options))
    refuse("backend options", "\"" + backend.options + "\"", "\"" + then.options + "\"");
  if (backend.executor != then.executor) refuse("--executor", backend.executor, then.executor);
  const Choices& chosen = checkpoint.choices;
  if (choices.csv != chosen.csv) refuse("--csv", choices.csv ? "yes" : "no", chosen.csv ? "yes" : "no");
  if (choices.perturbation != chosen.perturbation)
    refuse("--perturb", std::to_string(choices.perturbation), std::to_string(chosen.perturbation));
}

}  // namespace decant::pour
