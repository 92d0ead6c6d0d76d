/// \file
/// A moment of a live run becomes a recording like any other, and the backend is judged on it.
#pragma once

#include "oracle/backend.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <functional>
#include <string>

namespace decant::live {

struct Instant {
  Scene scene;
  ParticleState state;
  BackendInfo info;  // what moved the fluid
};

struct Kept {
  std::filesystem::path file;
  std::string ill_posed;  // why no backend can pass there; empty: one can
};

/// Writes the instant with the oracle's answer as a recording, under a name that is free. Of more than 20,000 particles it
/// holds a sample of the fields, and the shortest ensemble. Throws std::runtime_error where it cannot be written.
Kept keep_instant(const Instant& instant, const std::filesystem::path& folder);

/// What `decant conform` says of a backend on that recording: {verdict, rows: [{check, field, verdict, score, reason}]}.
nlohmann::ordered_json judge(const std::filesystem::path& file, Backend& backend);

}  // namespace decant::live
