/// \file
/// What can be chosen about a backend. None of it changes the answer beyond rounding.
#pragma once

#include <string>
#include <vector>

namespace decant::gpu {

struct SolverOptions {
  // Options and values go by their names on the command line.
  enum class WallCells { on, off };
  enum class MovingWalls { body_frame, rebuilt };
  enum class Sort { counting, thrust };
  enum class ForceNeighbors { cached, recomputed };
  enum class Build { grid, all_pairs };
  enum class Criterion { displacement, relative };
  enum class Tiles { automatic, on, off };
  enum class Launch { automatic, graph, stream };

  WallCells wall_cells = WallCells::on;
  MovingWalls moving_walls = MovingWalls::body_frame;
  Sort sort = Sort::counting;
  ForceNeighbors force_neighbors = ForceNeighbors::cached;
  Build build = Build::grid;
  Criterion criterion = Criterion::displacement;
  int rebuild = 0;               // substeps; 0: auto
  double skin = -1;              // of H; negative: auto
  int threads_per_particle = 0;  // 0: by the number of particles
  int capacity = 0;              // entries per thread that a list begins with; 0: by the skin
  Launch launch = Launch::automatic;
  Tiles tiles = Tiles::automatic;
  int ranks = 1;
  double halo_margin = -1;  // of H; negative: auto
  bool check_completeness = false;

  bool operator==(const SolverOptions&) const = default;
};

/// One option of the command line.
struct OptionDescription {
  const char* backends;  // names, a space between
  const char* key;
  const char* before;  // its name in version 0.1, still taken
  const char* values;  // for people to read, the default first
  const char* help;
  bool flag;  // also an option of the command itself, --key VALUE
};

const std::vector<OptionDescription>& option_descriptions();

/// Whether a backend has an option, by its key.
bool takes_option(const std::string& backend, const std::string& key);

/// Options as the command line gives them, "key=value:key=value", for a backend that knows `keys`.
/// Throws InputError for an unknown key or a value out of range.
SolverOptions parse_options(const std::string& backend, const std::string& text);

}  // namespace decant::gpu
