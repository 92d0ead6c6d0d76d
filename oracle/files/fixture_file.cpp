/// \file
/// Fixture files: one table of datasets serves writing, reading and checking, so that what is
/// written is what is asked for.
#include "oracle/files/fixture_file.hpp"

#include "oracle/files/hdf5_io.hpp"
#include "oracle/solution/digest.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace decant {
namespace {

/// Reports a wrong value; does not return.
using Fail = std::function<void(const std::string& key, const std::string& value, const std::string& bound)>;

// More than any scene of this project has by far; beyond it sampling would only eat memory.
constexpr double most_wall_particles = 1e8;

/// Calls visit(path, member, description, unit) for every dataset of /oracle, in digest order.
template <typename F, typename Visit>
void for_each_field(F& f, const Visit& visit) {
  visit("/oracle/boundary_volume", f.boundary_volume, "V_b of the wall particles", "m^3");
  visit("/oracle/density", f.density, "rho", "kg/m^3");
  visit("/oracle/pressure", f.pressure, "p", "Pa");
  visit("/oracle/acceleration", f.acceleration, "sum of the four parts and gravity", "m/s^2");
  visit("/oracle/pressure_acceleration", f.pressure_acceleration, "fluid on fluid", "m/s^2");
  visit("/oracle/viscous_acceleration", f.viscous_acceleration, "fluid on fluid", "m/s^2");
  visit("/oracle/wall_pressure_acceleration", f.wall_pressure_acceleration, "wall on fluid", "m/s^2");
  visit("/oracle/wall_viscous_acceleration", f.wall_viscous_acceleration, "wall on fluid", "m/s^2");
  visit("/oracle/fluid_neighbor_count", f.fluid_neighbor_count, "self excluded", "");
  visit("/oracle/fluid_neighbor_id_sum", f.fluid_neighbor_id_sum, "self excluded", "");
  visit("/oracle/wall_neighbor_count", f.wall_neighbor_count, "wall particles within H", "");
  visit("/oracle/wall_neighbor_id_sum", f.wall_neighbor_id_sum, "ids through all containers", "");
}

/// The same for /condition.
template <typename C, typename Visit>
void for_each_condition(C& c, const Visit& visit) {
  visit("/condition/density", c.density, "sum of m (W + r|W'|), walls alike", "kg/m^3");
  visit("/condition/density_pose", c.density_pose, "sum of rho0 V_b |W'| X_b", "kg/m^3");
  const auto* terms = "sum of |t| (1 + r|G'|/G)";
  visit("/condition/pressure_acceleration", c.pressure_acceleration, terms, "m/s^2");
  visit("/condition/viscous_acceleration", c.viscous_acceleration, terms, "m/s^2");
  visit("/condition/wall_pressure_acceleration", c.wall_pressure_acceleration, terms, "m/s^2");
  visit("/condition/wall_viscous_acceleration", c.wall_viscous_acceleration, terms, "m/s^2");
}

/// The same for /sample.
template <typename F, typename Visit>
void for_each_sample(F& f, const Visit& visit) {
  visit("/sample/id", f.sample_id, "ascending", "");
  visit("/sample/density", f.sample_density, "rho", "kg/m^3");
  visit("/sample/pressure", f.sample_pressure, "p", "Pa");
  visit("/sample/acceleration", f.sample_acceleration, "total", "m/s^2");
}

/// Writes a dataset by the type of its member.
struct Put {
  Hdf5Writer& out;
  void operator()(const char* path, const Eigen::VectorXd& v, const char* text, const char* unit) const {
    out.vector(path, v, unit, text);
  }
  void operator()(const char* path, const Eigen::Matrix3Xd& m, const char* text, const char* unit) const {
    out.matrix3(path, m, unit, text);
  }
  void operator()(const char* path, const IdVector& v, const char* text, const char*) const {
    out.integers(path, v, text);
  }
};

/// Reads a dataset by the type of its member; M values for boundary volumes, else N.
struct Get {
  const Hdf5Reader& in;
  std::int64_t n, walls;
  void operator()(const char* path, Eigen::VectorXd& v, const char*, const char*) const {
    v = in.vector(path, std::string_view(path) == "/oracle/boundary_volume" ? walls : n);
  }
  void operator()(const char* path, Eigen::Matrix3Xd& m, const char*, const char*) const { m = in.matrix3(path, n); }
  void operator()(const char* path, IdVector& v, const char*, const char*) const { v = in.integers(path, n); }
};

std::string place_of(double value, Eigen::Index column, Eigen::Index row, Eigen::Index rows) {
  const auto axis = rows == 3 ? fmt::format(", {}", "xyz"[row]) : std::string();
  return fmt::format("{:.9g} at {}{}", value, column, axis);
}

/// Holds a dataset's values to their length and range.
struct Check {
  const Fail& fail;
  Eigen::Index n, walls;

  template <typename Derived>
  void operator()(const std::string& path, const Eigen::MatrixBase<Derived>& values, const char*,
                  const char* = "") const {
    const Eigen::Index rows = values.rows(), cols = values.cols();
    const bool is_matrix = Derived::RowsAtCompileTime == 3;
    const Eigen::Index length = is_matrix ? cols : rows;
    const Eigen::Index expected = path == "/oracle/boundary_volume" ? walls : n;
    if (length != expected) fail(path, fmt::format("{} values", length), fmt::format("{} values", expected));
    for (Eigen::Index c = 0; c < cols; ++c)
      for (Eigen::Index r = 0; r < rows; ++r) {
        const auto value = static_cast<double>(values(r, c));
        const auto where = [&] { return is_matrix ? place_of(value, c, r, 3) : place_of(value, r, 0, 1); };
        if (!std::isfinite(value)) fail(path, where(), "finite");
        if (path.starts_with("/state/") && !(static_cast<double>(static_cast<float>(value)) == value))
          fail(path, where(), "representable in fp32");
        if (must_not_be_negative(path) && !(value >= 0)) fail(path, where(), ">= 0");
        if (must_be_positive(path) && !(value > 0)) fail(path, where(), "> 0");
      }
  }

  static bool must_not_be_negative(const std::string& path) {
    return path.starts_with("/condition/") || path.find("_count") != std::string::npos ||
           path.find("_id_sum") != std::string::npos || path == "/sample/id";
  }
  static bool must_be_positive(const std::string& path) {
    return path == "/oracle/boundary_volume" || path.ends_with("/density");
  }
};

/// Upper estimate of the scene's wall particles, from the area of the surfaces.
double wall_estimate(const Scene& scene) {
  double area = 0;
  for (const auto& container : scene.containers) {
    if (const auto* revolved = std::get_if<RevolvedShape>(&container.shape)) {
      const auto& p = revolved->profile;
      for (std::size_t k = 0; k < p.size(); ++k) {
        const auto& [r0, z0] = p[k];
        const auto& [r1, z1] = p[(k + 1) % p.size()];
        area += M_PI * (r0 + r1) * std::hypot(r1 - r0, z1 - z0);
      }
    } else {
      for (const auto& box : std::get<BoxShape>(container.shape).solid) {
        const Vec3 e = box.max - box.min;
        area += 2 * (e.x() * e.y() + e.y() * e.z() + e.z() * e.x());
      }
    }
  }
  return scene.wall_layers * area / (scene.particle_spacing * scene.particle_spacing);
}

/// Everything a fixture promises beyond the shapes of its datasets.
void check_fixture(const Fixture& f, Eigen::Index walls, const Fail& fail) {
  const Eigen::Index n = f.state.size();
  const Check check{fail, n, walls};
  if (f.phase.empty()) fail("/@phase", "\"\"", "a name");
  if (f.state.substep < 0) fail("/state@substep", std::to_string(f.state.substep), ">= 0");
  check("/state/position", f.state.position, "");
  check("/state/velocity", f.state.velocity, "");
  const auto ensemble = [&](const char* name, std::int64_t value, std::int64_t least) {
    if (value < least || value > 10'000)
      fail(std::string("/ensemble@") + name, std::to_string(value), fmt::format("in {} … 10000", least));
  };
  ensemble("substeps", f.ensemble.substeps, 1);
  ensemble("members", f.ensemble.members, 2);
  for (std::size_t k = 0; k < f.ensemble.mean.size(); ++k)
    for (const auto& [name, value] :
         {std::pair{"mean", f.ensemble.mean[k]}, std::pair{"deviation", f.ensemble.deviation[k]}})
      if (!(value >= 0 && std::isfinite(value)))
        fail(std::string("/ensemble/") + name, fmt::format("{:.9g} at {}", value, k), "finite, >= 0");
  if (f.fields) {
    if (!f.condition) fail("/condition", "missing", "required beside /oracle");
    for_each_field(*f.fields, check);
    for_each_condition(*f.condition, check);
    return;
  }
  const Eigen::Index sampled = f.sample_id.size();
  for_each_sample(f, Check{fail, sampled, walls});
  for (Eigen::Index k = 0; k < sampled; ++k) {
    const bool ascends = k == 0 || f.sample_id[k] > f.sample_id[k - 1];
    if (!ascends || f.sample_id[k] >= n)
      fail("/sample/id", fmt::format("{} at {}", f.sample_id[k], k), fmt::format("ascending, below {}", n));
  }
  if (sampled == 0 && n > 0) fail("/sample/id", "0 values", "at least 1");
  if (f.fields_digest.size() != 64) fail("/sample@fields_sha256", f.fields_digest, "64 hexadecimal digits");
}

Scene read_scene(const Hdf5Reader& in, const std::string& text) {
  Scene scene;
  try {
    scene = parse_scene(text, in.file().string());
  } catch (const InputError& error) {
    in.fail("/scene: " + error.key(), error.value(), error.bound());
  }
  if (scene.schedule.substeps_per_frame < 1)
    in.fail("/scene: schedule.substeps_per_frame", std::to_string(scene.schedule.substeps_per_frame), ">= 1");
  const double estimate = wall_estimate(scene);
  if (!(estimate <= most_wall_particles))
    in.fail("/scene: particle_spacing", fmt::format("{:.3g}", scene.particle_spacing),
            fmt::format("at most {:.0e} wall particles; about {:.1e} follow from it", most_wall_particles, estimate));
  return scene;
}

/// Today's walls must be those of the recording: their number, or M, comes back.
Eigen::Index read_walls(const Hdf5Reader& in, const Scene& scene) {
  Walls walls;
  try {
    walls = sample_walls(scene);
  } catch (const std::exception& error) {
    in.fail("/scene", error.what(), "a scene whose walls can be sampled");
  }
  const std::int64_t count = in.integer_attribute("/walls", "count");
  const std::string digest = in.text_attribute("/walls", "sha256"), today = digest_of(walls);
  const std::string hint = "; wall sampling has changed, re-record the fixture";
  if (count != walls.size()) in.fail("/walls@count", std::to_string(count), std::to_string(walls.size()) + hint);
  if (digest != today) in.fail("/walls@sha256", digest, today + hint);
  return walls.size();
}

constexpr Eigen::Index five = std::tuple_size_v<Divergence>;

Divergence measures(const Eigen::VectorXd& values) {
  Divergence d{};
  for (Eigen::Index k = 0; k < five; ++k) d[static_cast<std::size_t>(k)] = values[k];
  return d;
}

}  // namespace

Fixture read_fixture(const std::filesystem::path& file) {
  const Hdf5Reader in(file);
  const Fail fail = [&](const std::string& key, const std::string& value, const std::string& bound) {
    in.fail(key, value, bound);
  };
  const std::int64_t schema = in.integer_attribute("/", "decant_fixture");
  if (schema != fixture_schema) fail("/@decant_fixture", std::to_string(schema), std::to_string(fixture_schema));

  Fixture f;
  f.name = file.stem().string();
  f.sha256 = sha256_of_file(file);
  f.phase = in.text_attribute("/", "phase");
  const std::string scene_text = in.text("/scene");
  const std::string scene_sha = in.text_attribute("/provenance", "scene_sha256");
  if (scene_sha != sha256_of_text(scene_text))
    fail("/provenance@scene_sha256", scene_sha, sha256_of_text(scene_text) + ", as /scene has");
  for (const auto& name : in.attribute_names("/provenance"))
    f.provenance[name] = in.text_attribute("/provenance", name);
  f.scene = read_scene(in, scene_text);

  f.state.position = in.matrix3("/state/position");
  const std::int64_t n = f.state.size();
  f.state.velocity = in.matrix3("/state/velocity", n);
  f.state.substep = in.integer_attribute("/state", "substep");
  const double time = in.real_attribute("/state", "time");
  const double expected = f.scene.time_at(f.state.substep);
  if (!(std::abs(time - expected) <= 1e-12 * std::abs(expected)))
    fail("/state@time", fmt::format("{}", time), fmt::format("{}, substep × dt", expected));

  const Eigen::Index walls = read_walls(in, f.scene);
  if (in.has("/oracle") || !in.has("/sample")) {
    for_each_field(f.fields.emplace(), Get{in, n, walls});
    for_each_condition(f.condition.emplace(), Get{in, n, walls});
  } else {
    f.sample_id = in.integers("/sample/id");
    for_each_sample(f, Get{in, f.sample_id.size(), walls});
    f.fields_digest = in.text_attribute("/sample", "fields_sha256");
  }
  f.ensemble.substeps = in.integer_attribute("/ensemble", "substeps");
  f.ensemble.members = in.integer_attribute("/ensemble", "members");
  f.ensemble.mean = measures(in.vector("/ensemble/mean", five));
  f.ensemble.deviation = measures(in.vector("/ensemble/deviation", five));
  check_fixture(f, walls, fail);
  return f;
}

void write_fixture(const std::filesystem::path& file, const Fixture& f) {
  const Walls walls = sample_walls(f.scene);
  check_fixture(f, walls.size(), [&](const std::string& key, const std::string& value, const std::string& bound) {
    throw std::runtime_error(fmt::format("{}: {} = {}: {}", file.string(), key, value, bound));
  });
  const std::string scene_text = scene_to_json(f.scene);

  Hdf5Writer out(file, 9);
  out.attribute("/", "decant_fixture", fixture_schema);
  out.attribute("/", "phase", f.phase);
  out.text("/scene", scene_text, "the scene as canonical JSON");
  out.attribute("/state", "substep", f.state.substep);
  out.attribute("/state", "time", f.scene.time_at(f.state.substep));
  out.matrix3("/state/position", f.state.position, "m", "by particle", Storage::fp32);
  out.matrix3("/state/velocity", f.state.velocity, "m/s", "by particle", Storage::fp32);
  out.attribute("/walls", "count", static_cast<std::int64_t>(walls.size()));
  out.attribute("/walls", "sha256", digest_of(walls));
  if (f.fields) {
    for_each_field(*f.fields, Put{out});
    for_each_condition(*f.condition, Put{out});
  } else {
    for_each_sample(f, Put{out});
    out.attribute("/sample", "fields_sha256", f.fields_digest);
  }
  out.attribute("/ensemble", "substeps", f.ensemble.substeps);
  out.attribute("/ensemble", "members", f.ensemble.members);
  const auto measures_text = "rms_position (m), p99_position, rms_velocity (m/s), p99_velocity, energy (J)";
  out.vector("/ensemble/mean", Eigen::Map<const Eigen::VectorXd>(f.ensemble.mean.data(), five), "", measures_text);
  out.vector("/ensemble/deviation", Eigen::Map<const Eigen::VectorXd>(f.ensemble.deviation.data(), five), "",
             measures_text);
  auto provenance = f.provenance;
  provenance["scene_sha256"] = sha256_of_text(scene_text);
  for (const auto& [name, text] : provenance) out.attribute("/provenance", name, text);
  out.commit();
}

}  // namespace decant
