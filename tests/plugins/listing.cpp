// The example with neighbor lists that are rebuilt every rebuild=N substeps with skin=S; without options at every
// substep. They are given and not used, so that the run stays that of all pairs. lists=FAULT spoils them.
#include "oracle/plugin/examples/all_pairs.hpp"
#include "oracle/plugin/examples/as_plugin.hpp"

#include <cstdlib>
#include <sstream>

namespace {

using Plugin = PluginOf<AllPairs>;
const decant_plugin_table table = Plugin::table("all-pairs");

struct Lists {
  std::int64_t every = 1, built = -1, start = 0;
  float skin = 0;
  std::string fault;
  std::vector<std::int64_t> fluid_offsets, wall_offsets;
  std::vector<std::int32_t> fluid, wall;
  std::int64_t rebuilds = 0;
} kept;

int create_listing(const char* options, void** solver) {
  std::istringstream all(options);
  for (std::string option; std::getline(all, option, ':');) {
    const std::string key = option.substr(0, option.find('=')), value = option.substr(option.find('=') + 1);
    if (key == "rebuild") kept.every = std::atoll(value.c_str());
    else if (key == "skin") kept.skin = std::strtof(value.c_str(), nullptr);
    else if (key == "lists") kept.fault = value;
    else return table.create(option.c_str(), solver);
  }
  return table.create("", solver);
}

void build(Plugin& p) {
  kept.built = p.substep;
  ++kept.rebuilds;
  const float H = p.H;
  p.find_densities();  // places the walls
  p.H *= 1 + kept.skin;
  const auto take = [&](const std::vector<Vec>& targets, bool own, auto& offsets, auto& entries) {
    offsets.assign(1, 0), entries.clear();
    for (std::size_t i = 0; i < p.x.size(); ++i) {
      p.near(p.x[i], targets, [&](std::size_t j, const Vec&, float) {
        const bool half = kept.fault == "half" && own && j < i;
        if ((!own || j != i || kept.fault == "self") && !half) entries.push_back(static_cast<std::int32_t>(j));
      });
      offsets.push_back(static_cast<std::int64_t>(entries.size()));
    }
  };
  take(p.x, true, kept.fluid_offsets, kept.fluid);
  take(p.wall_x, false, kept.wall_offsets, kept.wall);
  p.H = H;
  if (kept.fault == "range") kept.fluid.front() = static_cast<std::int32_t>(p.x.size());
  if (kept.fault == "offsets") kept.fluid_offsets[1] = kept.fluid_offsets.back() + 1;
}

void build_where_due(Plugin& p) {
  if (kept.built != p.substep && (p.substep - kept.start) % kept.every == 0) build(p);
}

int load_listing(void* solver, const decant_scene* scene, const decant_walls* walls, const decant_state* state) {
  kept.start = state->substep;
  kept.built = -1;
  kept.rebuilds = 0;
  return table.load(solver, scene, walls, state);
}

int advance_listing(void* solver, std::int64_t substeps, decant_status* status) {
  for (std::int64_t k = 0; k < substeps && status->bits == 0; ++k) {
    build_where_due(Plugin::of(solver));
    Plugin::of(solver).step(*status);
  }
  return 0;
}

int lists(void* solver, decant_lists* out) {
  build_where_due(Plugin::of(solver));
  out->built = kept.fault == "built" ? kept.built - 1000 : kept.built;
  out->fluid_offsets = kept.fluid_offsets.data();
  out->fluid = kept.fluid.data();
  out->wall_offsets = kept.wall_offsets.data();
  out->wall = kept.wall.data();
  return 0;
}

int stage_times(void*, decant_stage_times* out) {
  *out = {sizeof *out, 0, 1, 2, 3, 4, 10, 20, 30, 40, kept.rebuilds};
  return 0;
}

decant_plugin_table listing;

}  // namespace

const decant_plugin_table* decant_plugin(std::uint32_t) {
  listing = table;
  listing.name = "listing";
#ifdef DECANT_TEST_FIXED
  listing.offers |= DECANT_OFFERS_LISTS;
#else
  listing.offers |= DECANT_OFFERS_LISTS | DECANT_OFFERS_REBUILD;
#endif
  listing.create = create_listing;
  listing.load = load_listing;
  listing.advance = advance_listing;
  listing.lists = lists;
  listing.stage_times = stage_times;
  return &listing;
}
