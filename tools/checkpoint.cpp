/// \file
/// Writes, reads and compares checkpoints.
#include "tools/checkpoint.hpp"

#include "oracle/fixture.hpp"
#include "oracle/hdf5_io.hpp"
#include "reference/error.hpp"
#include "reference/scene_file.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace decant {
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

}  // namespace

void write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint) {
  Hdf5Writer out(file, 1);  // the pour waits for it
  out.attribute("/", "schema", checkpoint_schema);
  out.attribute("/", "frame", checkpoint.frame);
  out.attribute("/", "substep", checkpoint.state.substep);
  out.attribute("/", "csv", checkpoint.csv ? 1 : 0);
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
  out.commit();
}

Checkpoint read_checkpoint(const std::filesystem::path& file) {
  const Hdf5Reader in(file);
  const std::int64_t schema = in.integer_attribute("/", "schema");
  if (schema != checkpoint_schema)
    in.fail("schema", std::to_string(schema), fmt::format("must be {}", checkpoint_schema));
  Checkpoint c;
  c.frame = in.integer_attribute("/", "frame");
  c.csv = in.integer_attribute("/", "csv") != 0;
  c.scene_json = in.text("/scene");
  c.backend = {in.text_attribute("/", "backend"), in.text_attribute("/", "options"),
               in.text_attribute("/", "executor"), in.text_attribute("/", "device"),
               in.text_attribute("/", "precision")};
  c.state.substep = in.integer_attribute("/", "substep");
  c.state.position = in.matrix3("/state/position");
  c.state.velocity = in.matrix3("/state/velocity", c.state.size());
  c.timeline = Timeline::read(in, "/timeline");
  const std::string sha = in.text_attribute("/", "scene_sha256");
  if (sha != sha256_of_text(c.scene_json))
    in.fail("scene_sha256", sha, "must be the digest of /scene");
  if (static_cast<std::int64_t>(c.timeline.rows.size()) != c.frame + 1)
    in.fail("/timeline/time", fmt::format("{} rows", c.timeline.rows.size()),
            fmt::format("must have {}", c.frame + 1));
  return c;
}

void check_same_pour(const std::filesystem::path& file, const Checkpoint& checkpoint,
                     const Scene& scene, const BackendInfo& backend, bool csv) {
  const auto refuse = [&](const std::string& key, const std::string& now, const std::string& then) {
    throw InputError(file.string(), key, now, "the pour to resume was started with " + then);
  };
  const std::string json = scene_to_json(scene);
  if (json != checkpoint.scene_json) {
    const auto now = nlohmann::json::parse(json),
               then = nlohmann::json::parse(checkpoint.scene_json);
    const auto difference = nlohmann::json::diff(then, now);
    // The frames decide the substep too; whoever changed them wants to read about them.
    std::string pointer =
        difference.empty() ? "" : difference.front().at("path").get<std::string>();
    for (const auto& change : difference)
      if (change.at("path") == "/time/frames") pointer = "/time/frames";
    refuse(key_of(pointer), value_at(now, pointer), value_at(then, pointer));
  }
  const BackendInfo& then = checkpoint.backend;
  if (backend.name != then.name) refuse("--backend", backend.name, then.name);
  if (backend.options != then.options)
    refuse("backend options", "\"" + backend.options + "\"", "\"" + then.options + "\"");
  if (backend.executor != then.executor) refuse("--executor", backend.executor, then.executor);
  if (csv != checkpoint.csv) refuse("--csv", csv ? "yes" : "no", checkpoint.csv ? "yes" : "no");
}

}  // namespace decant
