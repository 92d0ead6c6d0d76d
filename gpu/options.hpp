/// \file
/// What can be chosen about a backend. None of it changes the answer beyond rounding.
#pragma once

#include <string>
#include <vector>

namespace decant::gpu {

struct SolverOptions {
  enum class Grid { fluid, all };        // which particles have cells; others are all looked at
  enum class Source { frame, rebuilt };  // moving walls: in their frame, or sorted every substep
  enum class Sort { counting, thrust };
  enum class Pairs { keep, rescan };     // hash: the force pass reads a list, or cells again
  enum class Build { grid, all_pairs };  // list: from cells, or from all pairs
  enum class Trigger { local, global };  // list: what `rebuild auto` watches
  enum class Tiles { automatic, on, off };
  enum class Launch { automatic, graphs, plain };

  Grid grid = Grid::all;
  Source source = Source::frame;
  Sort sort = Sort::counting;
  Pairs pairs = Pairs::keep;
  Build build = Build::grid;
  Trigger trigger = Trigger::global;
  int rebuild = 0;                    // list: every so many substeps; 0: as soon as a pair could be missed
  double skin = -1;                   // list: of H; negative: by the speed of the fastest particle
  int lanes = 0;                      // threads a particle; 0: by the number of particles
  int capacity = 0;                   // entries a list begins with; 0: by the skin
  Launch launch = Launch::automatic;  // of substeps: many at once, recorded as graphs, one by one
  Tiles tiles = Tiles::automatic;     // list: small scenes in shared memory
  int ranks = 1;                      // threads of this process that share the particles
  double halo_margin = -1;            // of H: how far ghosts reach beyond it; negative: by speed and size
  bool verify = false;                // list: counts in every substep what its lists miss (verify.cuh)
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
