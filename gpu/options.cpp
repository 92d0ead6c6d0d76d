/// \file
/// One table: every option of a backend with its values, its help and how it is set.
#include "gpu/options.hpp"

#include "reference/error.hpp"

#include <algorithm>
#include <charconv>
#include <set>
#include <string_view>

namespace decant::gpu {
namespace {

[[noreturn]] void refuse(const std::string& key, const std::string& value, const std::string& bound) {
  throw InputError("command line", "--" + key, value, bound);
}

template <class Number>
Number number(const std::string& key, const std::string& text, Number least, Number most, const std::string& bound) {
  Number value{};
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stopped != end || !(value >= least && value <= most)) refuse(key, text, bound);
  return value;
}

/// A value by its name; `before` is what it was called in version 0.1.
template <class Choice>
struct Named {
  const char *name, *before;
  Choice choice;
};

template <class Choice>
Choice one_of(const std::string& key, const std::string& text, const std::vector<Named<Choice>>& choices) {
  std::string known;
  for (const auto& [name, before, choice] : choices) {
    if (text == name || text == before) return choice;
    known += (known.empty() ? "" : " or ") + std::string(name);
  }
  refuse(key, text, "must be " + known);
}

using O = SolverOptions;

/// \param v  the value's text
void set_threads(O& o, const std::string& v) {
  const std::string bound = "must be 1, 2, 4 or 8";
  o.threads_per_particle = number("threads_per_particle", v, 1, 8, bound);
  if (o.threads_per_particle & (o.threads_per_particle - 1)) refuse("threads_per_particle", v, bound);
}

void set_launch(O& o, const std::string& v) {
  o.launch = one_of<O::Launch>("launch", v,
                               {{"auto", "auto", O::Launch::automatic},
                                {"graph", "graphs", O::Launch::graph},
                                {"stream", "plain", O::Launch::stream}});
}

void set_capacity(O& o, const std::string& v) {
  o.capacity = number("capacity", v, 1, 4096, "must be in 1 … 4096 entries per thread");
}

struct Entry {
  OptionDescription description;
  void (*set)(O&, const std::string&);
};

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = {
      {{"hash", "wall_cells", "grid", "on, off", "off: every wall particle is tested", true},
       [](O& o, const std::string& v) {
         o.wall_cells = one_of<O::WallCells>("wall_cells", v,
                                             {{"on", "all", O::WallCells::on}, {"off", "fluid", O::WallCells::off}});
       }},
      {{"hash", "moving_walls", "source", "body_frame, rebuilt",
        "looked up in the container's frame, or sorted anew every substep", true},
       [](O& o, const std::string& v) {
         o.moving_walls = one_of<O::MovingWalls>(
             "moving_walls", v,
             {{"body_frame", "frame", O::MovingWalls::body_frame}, {"rebuilt", "rebuilt", O::MovingWalls::rebuilt}});
       }},
      {{"hash", "sort", "sort", "counting, thrust", "how particles come into the order of their cells", true},
       [](O& o, const std::string& v) {
         o.sort = one_of<O::Sort>("sort", v,
                                  {{"counting", "counting", O::Sort::counting}, {"thrust", "thrust", O::Sort::thrust}});
       }},
      {{"hash", "force_neighbors", "pairs", "cached, recomputed",
        "the force pass reads the pairs that were found, or searches again", true},
       [](O& o, const std::string& v) {
         o.force_neighbors = one_of<O::ForceNeighbors>(
             "force_neighbors", v,
             {{"cached", "keep", O::ForceNeighbors::cached}, {"recomputed", "rescan", O::ForceNeighbors::recomputed}});
       }},
      {{"list", "build", "build", "grid, all-pairs", "lists from cells, or from all pairs", true},
       [](O& o, const std::string& v) {
         o.build = one_of<O::Build>(
             "build", v, {{"grid", "grid", O::Build::grid}, {"all-pairs", "all-pairs", O::Build::all_pairs}});
       }},
      {{"list", "rebuild", "rebuild", "auto, N", "before a pair can be missed, or every N substeps", true},
       [](O& o, const std::string& v) {
         o.rebuild = v == "auto" ? 0 : number("rebuild", v, 1, 1000000, "must be auto or a number of substeps >= 1");
       }},
      {{"list", "criterion", "trigger", "displacement, relative",
        "what rebuild=auto bounds: displacements, or those of neighboring cells against each other", true},
       [](O& o, const std::string& v) {
         o.criterion = one_of<O::Criterion>(
             "criterion", v,
             {{"displacement", "global", O::Criterion::displacement}, {"relative", "local", O::Criterion::relative}});
       }},
      {{"list", "skin", "skin", "auto, a share of H", "how far beyond H lists reach; auto: by the fastest particle",
        true},
       [](O& o, const std::string& v) {
         o.skin = v == "auto" ? -1 : number("skin", v, 0.0, 1.0, "must be auto or in 0 … 1, a share of H");
       }},
      {{"list", "tiles", "tiles", "auto, on, off",
        "on: blocks keep what is near their particles in shared memory, where the scene is small enough; auto: on a "
        "GPU",
        false},
       [](O& o, const std::string& v) {
         o.tiles = one_of<O::Tiles>(
             "tiles", v,
             {{"auto", "auto", O::Tiles::automatic}, {"on", "on", O::Tiles::on}, {"off", "off", O::Tiles::off}});
       }},
      {{"list", "check_completeness", "verify", "off, on",
        "on: counts in every substep which pairs its lists lack; with rebuild=auto one is an error", false},
       [](O& o, const std::string& v) {
         o.check_completeness = one_of<bool>("check_completeness", v, {{"off", "off", false}, {"on", "on", true}});
       }},
      {{"hash list", "threads_per_particle", "lanes", "1, 2, 4, 8", "default: by the number of particles", false},
       set_threads},
      {{"hash list", "ranks", "ranks", "1, N",
        "ranks that share the particles, as threads; under mpirun its processes are the ranks", false},
       [](O& o, const std::string& v) { o.ranks = number("ranks", v, 1, 64, "must be in 1 … 64"); }},
      {{"hash list", "halo_margin", "halo_margin", "auto, a share of H",
        "of ranks: how far copies of other ranks' particles reach beyond H; auto: by speed and size", false},
       [](O& o, const std::string& v) {
         o.halo_margin =
             v == "auto" ? -1 : number("halo_margin", v, 0.02, 8.0, "must be auto or in 0.02 … 8, a share of H");
       }},
      {{"hash list", "capacity", "capacity", "N", "entries per thread that a list begins with; grows where needed",
        false},
       set_capacity},
      {{"hash list", "launch", "launch", "auto, graph, stream",
        "auto: a list's substeps in one persistent kernel where the scene is small, else a CUDA graph; stream: "
        "kernel by kernel",
        false},
       set_launch},
  };
  return all;
}

bool belongs_to(const Entry& entry, const std::string& backend) {
  const std::string_view backends = entry.description.backends;
  return backends == backend || backends.starts_with(backend + " ") || backends.ends_with(" " + backend);
}

}  // namespace

const std::vector<OptionDescription>& option_descriptions() {
  static const std::vector<OptionDescription> all = [] {
    std::vector<OptionDescription> out;
    for (const Entry& entry : entries()) out.push_back(entry.description);
    return out;
  }();
  return all;
}

bool takes_option(const std::string& backend, const std::string& key) {
  return std::any_of(entries().begin(), entries().end(),
                     [&](const Entry& e) { return belongs_to(e, backend) && key == e.description.key; });
}

SolverOptions parse_options(const std::string& backend, const std::string& text) {
  SolverOptions options;
  std::set<std::string> seen;
  for (std::size_t at = 0; at < text.size();) {
    const auto end = std::min(text.find(':', at), text.size());
    const std::string item = text.substr(at, end - at);
    const auto equals = item.find('=');
    std::string key = item.substr(0, equals);
    std::replace(key.begin(), key.end(), '-', '_');
    const auto entry = std::find_if(entries().begin(), entries().end(), [&](const Entry& e) {
      return belongs_to(e, backend) && (key == e.description.key || key == e.description.before);
    });
    if (equals == std::string::npos || entry == entries().end()) {
      std::string known;
      for (const Entry& e : entries())
        if (belongs_to(e, backend)) known += (known.empty() ? "" : ", ") + std::string(e.description.key);
      throw InputError("command line", "--backend", backend + ":" + item,
                       known.empty() ? backend + " takes no options" : "key=value, keys of " + backend + ": " + known);
    }
    if (!seen.insert(entry->description.key).second) refuse(entry->description.key, item, "given once");
    entry->set(options, item.substr(equals + 1));
    at = end + 1;
  }
  if (backend == "hash" && options.ranks > 1 && options.threads_per_particle > 1)
    refuse("threads_per_particle", std::to_string(options.threads_per_particle),
           "1 with ranks: the order of sums would depend on a rank's share");
  if (options.rebuild == 0 && options.skin >= 0 && options.skin < 0.01)
    refuse("skin", text, "at least 0.01 where --rebuild is auto: without skin every move is too far");
  return options;
}

}  // namespace decant::gpu
