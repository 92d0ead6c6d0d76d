/// \file
/// The scene of a run that is changed while it runs: values set by the user, cups moved by hand. What the scene's own
/// rules refuse is refused with their text.
#pragma once

#include "reference/scene.hpp"
#include "reference/scene_checks.hpp"
#include "reference/state.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace decant::live {

class LiveScene {
 public:
  /// \param text  of a scene file; \param file  its name for messages; \param distances  known of a recording's
  /// scene. Throws InputError.
  LiveScene(const std::string& text, std::string file, Distances distances = Distances::unknown);

  /// The scene that runs, its cups where hands have them.
  const Scene& running() const { return running_; }
  /// The scene as the user has it, without what was moved by hand: JSON that a file may hold.
  std::string text() const { return json_.dump(2); }
  const std::vector<std::string>& warnings() const { return warnings_; }

  /// What becomes of a run whose scene is changed.
  enum class Outcome { goes_on, restarts };

  /// Gives a value of the scene file another one. Where the run goes on, its substep may become shorter: `substep` is
  /// then counted anew, at the same time. Throws InputError, and nothing is changed.
  /// \param pointer  JSON pointer into the scene file: "/gravity", "/fluid/viscosity"
  Outcome set(const std::string& pointer, const nlohmann::ordered_json& value, std::int64_t& substep);
  /// Another scene. Throws InputError, and nothing is changed.
  void replace(const std::string& text) { replace(text, Distances::unknown); }
  /// As many particles. Throws InputError, and nothing is changed.
  void set_particles(std::int64_t particles);
  /// As it was at first: no hand, and no substep shorter than a frame's number of them needs to be a multiple of this.
  void restart(int multiple_of = 1);

  /// Turns a container by hand, from where it is at `substep`, at hand_rate. Throws InputError where the container
  /// has no tilt or the angle is not within ±720°.
  void tilt(const std::string& container, double degrees, std::int64_t substep);
  /// Back to the scene's schedule: the hand turns it to where the schedule has it, and lets go.
  void follow_schedule(const std::string& container, std::int64_t substep);
  /// Whether a hand is at work.
  bool by_hand(const std::string& container) const { return hands_.contains(container); }
  /// Where hands turn containers to, degrees, by name.
  std::map<std::string, double> hand_targets() const;

  /// So many of `substeps` as a hand may go on without a look at where it goes; 1 at least.
  std::int64_t until_arrival(std::int64_t substep, std::int64_t substeps) const;
  /// Where hands have arrived, they stop. Whether the scene became another one.
  bool arrive(std::int64_t substep);

  /// rad/s; a quarter of the scene's largest speed at the container's rim, 90°/s at most.
  double hand_rate(const Container& container) const;

 private:
  /// What moves a container in place of its schedule.
  struct Hand {
    double target = 0;         // rad
    bool to_schedule = false;  // the target is where the schedule has it
    bool moving = false;
  };

  struct Parsed {
    Scene scene;
    std::vector<std::string> warnings;
  };
  void replace(const std::string& text, Distances distances);
  Parsed parse(const std::string& text, Distances distances = Distances::unknown) const;
  void take(nlohmann::ordered_json json, Parsed parsed);
  Container& running_container(const std::string& name);
  /// Of a container that can tilt, without hands.
  const Tilt& schedule(const std::string& container) const;
  double scheduled(const std::string& container, std::int64_t substep) const;
  void turn(const std::string& container, Hand hand, std::int64_t substep);

  std::string file_;
  nlohmann::ordered_json json_;
  Scene given_, running_;
  std::vector<std::string> warnings_;
  std::map<std::string, Hand> hands_;
};

}  // namespace decant::live
