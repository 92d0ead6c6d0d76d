/// \file
/// A pour that is looked at and changed while it runs: the solver's loop, what it is told, what it shows. It knows of
/// no network; whoever looks is a Viewer.
#pragma once

#include "oracle/backend.hpp"
#include "reference/state.hpp"
#include "tools/live/live_scene.hpp"
#include "tools/live/picture.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace decant::live {

/// Whoever looks. Called by the run's threads.
class Viewer {
 public:
  virtual ~Viewer() = default;
  /// Whether anybody looks at all.
  virtual bool watched() const = 0;
  /// Whether somebody has drawn the picture before.
  virtual bool wants_picture() const = 0;
  virtual void picture(Message bytes) = 0;
  /// What the page is told: "type" is "scene", "status", "scores", "note", "error", "kept" or "verdict". Of "scene",
  /// "status" and "scores" the last one goes to whoever comes later, too.
  virtual void tell(const nlohmann::ordered_json& message) = 0;
};

/// A choice of --backend to a solver.
using MakeBackend = std::function<std::unique_ptr<Backend>(const std::string& choice)>;

struct Options {
  std::string backend;                // as on the command line
  std::string executor;               // as on the command line, for the commands that the page shows
  std::vector<std::string> backends;  // that the page offers
  MakeBackend make_backend;
  std::optional<ParticleState> start;  // of a recording; none: the scene's initial state
  std::filesystem::path keep = ".";    // folder of what is kept
  double pictures_per_second = 30;     // at most
  double speed = 0;                    // s of the scene per s of clock, at most; 0: as fast as it goes
  bool paused = false;
};

/// What a page may ask, as JSON; "do" says what:
///   pause, go_on, step, reset
///   speed {value}              s of the scene per s, 0: as fast as it goes
///   set {pointer, value}       a value of the scene file
///   particles {value}          about so many
///   scene {text}               another scene file
///   backend {choice}           with options, as of --backend
///   tilt {container, degrees}  by hand; schedule {container}: as the scene has it
///   color {by}                 one of quantity_names
///   keep, judge                saves the instant as a recording; and judges the backend on it
class Run {
 public:
  /// Throws InputError.
  Run(LiveScene scene, Options options, Viewer& viewer);
  ~Run();
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  /// By any thread: hands over what a page asks. What is wrong with it is told as an "error".
  void ask(std::string json);
  /// Makes the backend and loads the scene. Throws InputError and BackendError.
  void start();
  /// Runs until `stop`, after `start`.
  void go(const std::function<bool()>& stop);
  /// Whether a recording, a verdict or scores are under way, which the destructor would wait for.
  bool busy() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace decant::live
