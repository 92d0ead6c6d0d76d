/// \file
/// Changes go through the scene file's own reader, so that its rules alone decide.
#include "tools/live/live_scene.hpp"

#include "reference/error.hpp"
#include "reference/pose.hpp"
#include "reference/scene_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace decant::live {
namespace {

using nlohmann::ordered_json;

constexpr double degree = std::numbers::pi / 180;

/// What may change under a fluid that moves: forces, not which particles there are.
constexpr std::array<const char*, 6> goes_on_with = {
    "/gravity", "/fluid/viscosity", "/fluid/wall_viscosity", "/fluid/sound_speed", "/fluid/allow_tension", "/contact"};

/// How far a container's points are from its tilt's line at most, m, or from its origin.
double reach(const Container& container) {
  double farthest = 0;
  const auto consider = [&](const Vec3& local) {
    const Vec3 from = container.origin + local - container.tilt->pivot;
    farthest = std::max(farthest, (from - container.tilt->axis.dot(from) * container.tilt->axis).norm());
  };
  if (const auto* revolved = std::get_if<RevolvedShape>(&container.shape)) {
    for (const auto& [r, z] : revolved->profile)
      for (const Vec3& side : {Vec3(r, 0, z), Vec3(-r, 0, z), Vec3(0, r, z), Vec3(0, -r, z)}) consider(side);
  } else {
    for (const SolidBox& box : std::get<BoxShape>(container.shape).solid)
      for (int corner = 0; corner < 8; ++corner)
        consider({corner & 1 ? box.max.x() : box.min.x(), corner & 2 ? box.max.y() : box.min.y(),
                  corner & 4 ? box.max.z() : box.min.z()});
  }
  return farthest;
}

}  // namespace

LiveScene::LiveScene(const std::string& text, std::string file, Distances distances) : file_(std::move(file)) {
  replace(text, distances);
}

LiveScene::Parsed LiveScene::parse(const std::string& text, Distances distances) const {
  Parsed parsed;
  parsed.scene = complete_scene(text, file_, &parsed.warnings, distances);
  return parsed;
}

void LiveScene::take(ordered_json json, Parsed parsed) {
  json_ = std::move(json);
  given_ = std::move(parsed.scene);
  warnings_ = std::move(parsed.warnings);
}

void LiveScene::restart(int multiple_of) {
  hands_.clear();
  running_ = given_;
  int& substeps = running_.schedule.substeps_per_frame;
  if (substeps % multiple_of == 0) return;
  substeps = (substeps + multiple_of - 1) / multiple_of * multiple_of;
  running_.schedule.substeps_derived = false;
}

std::map<std::string, double> LiveScene::hand_targets() const {
  std::map<std::string, double> targets;
  for (const auto& [name, hand] : hands_) targets[name] = hand.target / degree;
  return targets;
}

void LiveScene::replace(const std::string& text, Distances distances) {
  Parsed parsed = parse(text, distances);  // says line and column of what is no JSON
  take(ordered_json::parse(text, nullptr, true, true), std::move(parsed));
  restart();
}

void LiveScene::set_particles(std::int64_t particles) {
  // On the host a particle takes this much with its neighbors and its part of the walls, at least.
  constexpr double bytes = 600;
  const auto most = static_cast<std::int64_t>(static_cast<double>(::sysconf(_SC_PHYS_PAGES)) *
                                              static_cast<double>(::sysconf(_SC_PAGESIZE)) / bytes);
  if (particles < 1 || particles > most)
    throw InputError(file_, "particles", std::to_string(particles),
                     fmt::format("must be 1 … {}, which this machine's memory holds", most));
  ordered_json json = json_;
  json["particle_spacing"] = with_particles(given_, particles).particle_spacing;
  Parsed parsed = parse(json.dump());
  take(std::move(json), std::move(parsed));
  restart();
}

LiveScene::Outcome LiveScene::set(const std::string& pointer, const ordered_json& value, std::int64_t& substep) {
  ordered_json json = json_;
  try {
    // A key may be new; an index may not, which nlohmann-json would fill an array up to.
    const ordered_json::json_pointer place(pointer);
    if (!json.at(place.parent_pointer()).is_object()) (void)json.at(place);
    json[place] = value;
  } catch (const ordered_json::exception&) {
    throw InputError(file_, pointer, value.dump(), "no such place in this scene");
  }
  const bool goes_on = std::ranges::any_of(goes_on_with, [&](const char* one) { return pointer.starts_with(one); });
  Parsed parsed = parse(json.dump(), goes_on ? Distances::known : Distances::unknown);
  take(std::move(json), std::move(parsed));
  if (!goes_on) {
    restart();
    return Outcome::restarts;
  }
  // The substep is shortened by a whole number, so that time is a whole number of substeps still; it stays short.
  const int needed = given_.schedule.substeps_per_frame, before = running_.schedule.substeps_per_frame;
  const int factor = std::max(1, (needed + before - 1) / before);
  std::vector<Container> containers = std::move(running_.containers);
  running_ = given_;
  running_.containers = std::move(containers);
  running_.schedule.substeps_per_frame = before * factor;
  running_.schedule.substeps_derived =
      running_.schedule.substeps_per_frame == needed && given_.schedule.substeps_derived;
  substep *= factor;
  // Their rate follows from the scene's speeds.
  for (const auto& [name, hand] : std::map(hands_)) turn(name, hand, substep);
  return Outcome::goes_on;
}

double LiveScene::hand_rate(const Container& container) const {
  return std::min(90 * degree, 0.25 * expected_max_speed(given_) / std::max(reach(container), 1e-12));
}

Container& LiveScene::running_container(const std::string& name) {
  const auto found =
      std::ranges::find_if(running_.containers, [&](const Container& c) { return c.name == name && c.tilt; });
  if (found == running_.containers.end()) throw InputError(file_, "tilt", name, "a container that can tilt");
  return *found;
}

const Tilt& LiveScene::schedule(const std::string& container) const {
  return *std::ranges::find(given_.containers, container, &Container::name)->tilt;
}

double LiveScene::scheduled(const std::string& container, std::int64_t substep) const {
  return tilt_at(schedule(container), running_.time_at(substep)).angle;
}

/// From where the container is now: at a constant rate towards the target, or at rest.
void LiveScene::turn(const std::string& container, Hand hand, std::int64_t substep) {
  Container& moved = running_container(container);
  const double now = running_.time_at(substep), angle = tilt_at(*moved.tilt, now).angle;
  const double rate = hand_rate(moved), to_go = hand.target - angle;
  hand.moving = std::abs(to_go) > 0.5 * rate * running_.time_step();
  moved.tilt->keys = {{now, angle}};
  moved.tilt->rate = hand.moving ? std::copysign(rate, to_go) : 0.0;
  moved.tilt->oscillation.reset();
  hands_[container] = hand;
  // A turn without end would lift the fluid higher than the schedule's rules foresee; a hand stops in time.
  running_.schedule.max_speed = expected_max_speed(given_);
  running_.schedule.substeps_derived = false;
}

void LiveScene::tilt(const std::string& container, double degrees, std::int64_t substep) {
  (void)running_container(container);
  if (!(std::abs(degrees) <= 720))
    throw InputError(file_, fmt::format("tilt of {}", container), fmt::format("{}", degrees), "must be in -720 … 720°");
  turn(container, {degrees * degree, false, false}, substep);
}

void LiveScene::follow_schedule(const std::string& container, std::int64_t substep) {
  (void)running_container(container);
  if (hands_.contains(container)) turn(container, {scheduled(container, substep), true, false}, substep);
}

std::int64_t LiveScene::until_arrival(std::int64_t substep, std::int64_t substeps) const {
  for (const Container& container : running_.containers) {
    const auto hand = hands_.find(container.name);
    if (hand == hands_.end() || !hand->second.moving) continue;
    // A schedule moves on: its place is looked at every hundredth of a second of the scene.
    const double angle = tilt_at(*container.tilt, running_.time_at(substep)).angle;
    const double per_substep = std::abs(container.tilt->rate) * running_.time_step();
    double left = std::floor(std::abs(hand->second.target - angle) / per_substep + 0.5);
    if (hand->second.to_schedule) left = std::min(left, std::ceil(0.01 / running_.time_step()));
    substeps = std::min(substeps, static_cast<std::int64_t>(std::max(left, 1.0)));
  }
  return substeps;
}

bool LiveScene::arrive(std::int64_t substep) {
  bool changed = false;
  for (auto& [name, hand] : std::map(hands_)) {
    Container& container = running_container(name);
    const double angle = tilt_at(*container.tilt, running_.time_at(substep)).angle;
    const double width = 0.75 * std::abs(container.tilt->rate) * running_.time_step();
    const bool passed = (hand.target - angle) * container.tilt->rate < 0;
    if (hand.to_schedule) {
      const double target = scheduled(name, substep);
      if (std::abs(target - angle) <= width) {
        container.tilt = schedule(name);
        hands_.erase(name);
      } else {
        turn(name, {target, true, false}, substep);
      }
      changed = true;
    } else if (hand.moving && (passed || std::abs(hand.target - angle) <= width)) {
      turn(name, {angle, false, false}, substep);
      changed = true;
    }
  }
  return changed;
}

}  // namespace decant::live
