/// \file
/// What the page is told, as JSON.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/checks/audit.hpp"
#include "tools/live/live_scene.hpp"
#include "tools/live/scores.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace decant::live {

/// What the solver's loop knows at an instant beside the state.
struct LoopStatus {
  bool paused = false;
  std::string failed;              // why the run cannot go on; empty: it can
  double speed = 0;                // s of the scene per s of clock that were asked for
  double substeps_per_second = 0;  // while it advances
  double scene_per_second = 0;     // s of the scene per s of clock, by the clock
  double pictures_per_second = 0;
  StageTimes stages;  // since the status before
  NeighborStats neighbors;
  std::map<std::string, double> by_hand;  // degrees that hands turn containers to
};

/// "scene": what is drawn, what can be changed and what it is now.
nlohmann::ordered_json scene_message(const LiveScene& scene, Eigen::Index particles, Eigen::Index wall_particles,
                                     const BackendInfo& info, const std::string& choice,
                                     const std::vector<std::string>& backends);

/// "status": times, energies, mass per region, stages, what the scene's limits say.
nlohmann::ordered_json status_message(const Scene& scene, const LoopStatus& loop, std::int64_t substep,
                                      const AuditResult& audit);

/// "scores": the largest one and where.
nlohmann::ordered_json scores_message(const Scores& scores);

}  // namespace decant::live
