/// \file
/// Frames read one at a time from all pours at once, so that size is no limit.
#include "tools/pour/pour_diff.hpp"

#include "oracle/files/hdf5_io.hpp"
#include "oracle/report/console_table.hpp"
#include "oracle/report/report.hpp"
#include "reference/error.hpp"
#include "reference/neighbors.hpp"
#include "reference/scene_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

namespace decant::pour {
namespace {

constexpr std::size_t elsewhere = 4;  // of compared_fields

struct FrameValues {
  Eigen::Matrix3Xd position, velocity;
  Eigen::VectorXd density, pressure, place;
};

/// The frames of one pour.
class Frames {
 public:
  explicit Frames(const std::filesystem::path& path) : in_(file_of(path)) {
    time_ = in_.vector("/time");
    const auto shape = in_.shape("/fluid/position");
    if (shape.size() != 3) in_.fail("/fluid/position", "no frames", "frame, particle, x y z");
    particles_ = shape[1];
    scene_ = in_.text("/scene");
  }
  std::int64_t particles() const { return particles_; }
  std::int64_t frames() const { return time_.size(); }
  const std::string& scene() const { return scene_; }
  double time(std::int64_t frame) const { return time_[frame]; }
  /// NaN stands where a frame has not been written yet.
  bool written(std::int64_t frame) const { return frame < time_.size() && std::isfinite(time_[frame]); }
  FrameValues at(std::int64_t frame) const {
    return {in_.matrix3_at("/fluid/position", frame), in_.matrix3_at("/fluid/velocity", frame),
            in_.vector_at("/fluid/density", frame), in_.vector_at("/fluid/pressure", frame),
            in_.integers_at("/fluid/place", frame).cast<double>()};
  }
  [[noreturn]] void refuse(const std::string& key, const std::string& value, const std::string& bound) const {
    in_.fail(key, value, bound);
  }

 private:
  /// An interrupted pour's frames so far will do.
  static std::filesystem::path file_of(const std::filesystem::path& path) {
    if (!std::filesystem::is_directory(path)) return path;
    for (const char* name : {"frames.h5", "frames.h5.partial"})
      if (std::filesystem::exists(path / name)) return path / name;
    throw InputError(path.string(), "frames.h5", "missing", "a folder that `decant pour` wrote");
  }

  Hdf5Reader in_;
  Eigen::VectorXd time_;
  std::int64_t particles_ = 0;
  std::string scene_;
};

/// Throws InputError where another scene or number of particles stands there.
void require_same_scene(const Frames& first, const Frames& other) {
  if (other.particles() != first.particles())
    other.refuse("/fluid/position", fmt::format("{} particles", other.particles()),
                 fmt::format("{} particles, as the first pour has", first.particles()));
  if (other.scene() == first.scene()) return;
  const auto a = nlohmann::json::parse(first.scene(), nullptr, false),
             b = nlohmann::json::parse(other.scene(), nullptr, false);
  const auto changes = nlohmann::json::diff(a, b);
  if (changes.empty()) return;  // written otherwise, but the same
  const std::string at = changes[0].value("path", "");
  const nlohmann::json::json_pointer place(at);
  const auto shown = [&](const nlohmann::json& scene) {
    return scene.contains(place) ? scene[place].dump() : std::string("absent");
  };
  other.refuse("/scene", fmt::format("{} = {}", at.empty() ? "whole" : at.substr(1), shown(b)),
               fmt::format("{}: pours of one scene can be compared", shown(a)));
}

double rms(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return a.size() ? (a - b).norm() / std::sqrt(static_cast<double>(a.size())) : 0.0;
}

double kinetic_energy(const Scene& scene, const FrameValues& f) {
  return 0.5 * scene.particle_mass() * f.velocity.squaredNorm();
}

FieldDistances distances(const Scene& scene, const FrameValues& a, const FrameValues& b,
                         FrameDifference* out = nullptr) {
  const Separation separation(scene.domain);
  const auto n = a.position.cols();
  double squares = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double d = separation(Vec3(a.position.col(i)), Vec3(b.position.col(i))).norm() / scene.particle_spacing;
    squares += d * d;
    if (out && !(d <= out->farthest)) {
      out->farthest = d;
      out->farthest_particle = i;
    }
  }
  const double count = std::max<double>(1.0, static_cast<double>(n));
  return {std::sqrt(squares / count),
          (a.velocity - b.velocity).norm() / std::sqrt(count),
          rms(a.density, b.density),
          rms(a.pressure, b.pressure),
          static_cast<double>((a.place.array() != b.place.array()).count()),
          std::abs(kinetic_energy(scene, a) - kinetic_energy(scene, b))};
}

/// Frames for the table: the first that differs, the first beyond the spread, the last, and some
/// between.
std::set<std::size_t> shown_frames(const Difference& diff) {
  constexpr std::size_t most = 16;
  std::set<std::size_t> shown;
  const std::int64_t marks[] = {diff.first_difference(), diff.beyond().frame};
  for (std::size_t k = 0; k < diff.frames.size(); ++k) {
    const bool marked = std::find(std::begin(marks), std::end(marks), diff.frames[k].frame) != std::end(marks);
    const std::size_t step = (diff.frames.size() + most - 1) / most;
    if (marked || k % step == 0 || k + 1 == diff.frames.size()) shown.insert(k);
  }
  return shown;
}

nlohmann::ordered_json by_field(const FieldDistances& values) {
  nlohmann::ordered_json all;
  for (std::size_t k = 0; k < values.size(); ++k) all[compared_fields[k]] = values[k];
  return all;
}

}  // namespace

std::int64_t Difference::first_difference() const {
  for (const auto& f : frames)
    for (const double d : f.distance)
      if (!(d == 0)) return f.frame;
  return -1;
}

std::vector<std::string> Difference::first_fields() const {
  std::vector<std::string> fields;
  const std::int64_t first = first_difference();
  for (const auto& f : frames)
    if (f.frame == first)
      for (std::size_t k = 0; k < f.distance.size(); ++k)
        if (!(f.distance[k] == 0)) fields.emplace_back(compared_fields[k]);
  return fields;
}

Difference::Beyond Difference::beyond() const {
  FieldDistances widest{};  // so far; a difference that has once arisen may show a frame later
  if (spread_pours > 0) widest[elsewhere] = 1;
  for (const auto& f : frames)
    for (std::size_t k = 0; k < (spread_pours > 0 ? judged_fields : f.distance.size()); ++k) {
      widest[k] = std::max(widest[k], f.spread[k]);
      if (f.distance[k] <= factor * widest[k]) continue;
      const double times = f.distance[k] / widest[k];
      return {f.frame, k, std::isnan(times) || spread_pours == 0 ? infinity : times};
    }
  return {};
}

bool is_pour(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) return true;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return false;
  try {
    return Hdf5Reader(path).has("/fluid/position");
  } catch (const InputError&) {
    return false;
  }
}

Difference difference(const std::filesystem::path& before, const std::filesystem::path& after,
                      const std::vector<std::filesystem::path>& spread, double factor) {
  std::vector<std::unique_ptr<Frames>> pours;
  for (const auto* path : {&before, &after}) pours.push_back(std::make_unique<Frames>(*path));
  for (const auto& path : spread) pours.push_back(std::make_unique<Frames>(path));
  for (const auto& pour : pours) require_same_scene(*pours[0], *pour);
  const Scene scene = parse_scene(pours[0]->scene(), before.string());

  Difference diff;
  diff.particles = pours[0]->particles();
  diff.factor = factor;
  diff.spread_pours = spread.empty() ? 0 : static_cast<std::int64_t>(spread.size()) + 1;
  FieldDistances widest{};
  for (std::int64_t k = 0; k < pours[0]->frames(); ++k) {
    if (!std::all_of(pours.begin(), pours.end(), [&](const auto& p) { return p->written(k); })) {
      ++diff.frames_missing;
      continue;
    }
    FrameDifference f;
    f.frame = k;
    f.time = pours[0]->time(k);
    std::vector<FrameValues> values;
    for (const auto& pour : pours) values.push_back(pour->at(k));
    f.distance = distances(scene, values[0], values[1], &f);
    for (std::size_t i = 0; i < values.size(); ++i)
      for (std::size_t j = i + 1; j < values.size(); ++j) {
        if (i == 1 || j == 1) continue;  // what is asked about is no part of the spread
        const FieldDistances apart = distances(scene, values[i], values[j]);
        for (std::size_t d = 0; d < apart.size(); ++d) widest[d] = std::max(widest[d], apart[d]);
      }
    f.spread = widest;
    diff.frames.push_back(f);
  }
  if (diff.frames.empty()) pours[1]->refuse("/time", "no frame", "at least one frame that all the pours have");
  return diff;
}

std::string difference_line(const Difference& diff) {
  std::string line = fmt::format("{} frames of {} particles", diff.frames.size(), diff.particles);
  if (diff.frames_missing > 0) line += fmt::format(" ({} not written in all)", diff.frames_missing);
  const std::int64_t first = diff.first_difference();
  if (first < 0) return line + ": the same bits";
  line += fmt::format(": part in frame {} by {}", first, fmt::join(diff.first_fields(), ", "));
  const auto& last = diff.frames.back();
  line += fmt::format("; {:.3g} dx apart at the end (rms)", last.distance[0]);
  if (diff.spread_pours == 0) return line;
  const auto beyond = diff.beyond();
  if (beyond.frame < 0) return line + fmt::format(": within the spread of {} pours", diff.spread_pours);
  return line + fmt::format(": beyond the spread of {} pours in frame {} by {}, {:.3g} times", diff.spread_pours,
                            beyond.frame, compared_fields[beyond.field], beyond.times);
}

std::string difference_text(const Difference& diff) {
  const bool spread = diff.spread_pours > 0;
  std::string text =
      fmt::format("{:>6} {:>9}  {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}{}\n", "frame", "time (s)", "rms (dx)", "max (dx)",
                  "m/s", "kg/m^3", "Pa", "elsewhere", spread ? "  of the spread" : "");
  for (const std::size_t k : shown_frames(diff)) {
    const FrameDifference& f = diff.frames[k];
    text += fmt::format("{:>6} {:>9.5g}  {:>9.3g} {:>9.3g} {:>9.3g} {:>9.3g} {:>9.3g} {:>9}", f.frame, f.time,
                        f.distance[0], f.farthest, f.distance[1], f.distance[2], f.distance[3], f.distance[4]);
    if (spread) {
      double most = 0;
      std::size_t field = 0;
      for (std::size_t d = 0; d < judged_fields; ++d) {
        const double spread_of = std::max(f.spread[d], d == elsewhere ? 1.0 : 0.0);
        const double times = f.distance[d] == 0 ? 0 : f.distance[d] / spread_of;
        if (!(times <= most)) {
          most = times;
          field = d;
        }
      }
      text += most == 0 ? fmt::format("  {:>6}", 0) : fmt::format("  {:>6.3g} {}", most, compared_fields[field]);
    }
    while (text.back() == ' ') text.pop_back();
    text += '\n';
  }
  return text + "\n" + wrapped(difference_line(diff), 0);
}

std::string difference_json(const Difference& diff, int exit_status) {
  const auto beyond = diff.beyond();
  nlohmann::ordered_json all = {{"kind", "pours"},
                                {"summary", difference_line(diff)},
                                {"exit_status", exit_status},
                                {"particles", diff.particles},
                                {"frames_missing", diff.frames_missing},
                                {"spread_pours", diff.spread_pours},
                                {"factor", diff.factor},
                                {"first_difference", nullptr},
                                {"beyond", nullptr}};
  if (diff.first_difference() >= 0)
    all["first_difference"] = {{"frame", diff.first_difference()}, {"fields", diff.first_fields()}};
  if (beyond.frame >= 0) {
    all["beyond"] = {{"frame", beyond.frame}, {"field", compared_fields[beyond.field]}};
    if (std::isfinite(beyond.times)) all["beyond"]["times"] = beyond.times;
  }
  auto frames = nlohmann::ordered_json::array();
  for (const FrameDifference& f : diff.frames) {
    nlohmann::ordered_json frame = {{"frame", f.frame},
                                    {"time", f.time},
                                    {"distance", by_field(f.distance)},
                                    {"farthest", f.farthest},
                                    {"farthest_particle", f.farthest_particle}};
    if (diff.spread_pours > 0) frame["spread"] = by_field(f.spread);
    frames.push_back(std::move(frame));
  }
  nlohmann::ordered_json units;
  for (std::size_t k = 0; k < compared_fields.size(); ++k) units[compared_fields[k]] = compared_field_units[k];
  all["units"] = units;
  all["by_frame"] = std::move(frames);
  return all.dump(2);
}

}  // namespace decant::pour
