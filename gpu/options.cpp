/// \file
/// Which keys a backend knows, and what their values may be.
#include "gpu/options.hpp"

#include "reference/error.hpp"

#include <charconv>
#include <functional>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace decant::gpu {
namespace {

[[noreturn]] void refuse(const std::string& key, const std::string& value,
                         const std::string& bound) {
  throw InputError("command line", "--" + key, value, bound);
}

template <class Number>
Number number(const std::string& key, const std::string& text, Number least, Number most,
              const std::string& bound) {
  Number value{};
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stopped != end || !(value >= least && value <= most))
    refuse(key, text, bound);
  return value;
}

template <class Choice>
Choice one_of(const std::string& key, const std::string& text,
              const std::vector<std::pair<const char*, Choice>>& choices) {
  std::string known;
  for (const auto& [name, choice] : choices) {
    if (text == name) return choice;
    known += (known.empty() ? "" : " or ") + std::string(name);
  }
  refuse(key, text, "must be " + known);
}

using Setter = std::function<void(SolverOptions&, const std::string&)>;
using O = SolverOptions;

const std::map<std::string, std::map<std::string, Setter>>& known_options() {
  static const auto lanes = [](O& o, const std::string& v) {
    o.lanes = number("lanes", v, 1, 8, "must be 1, 2, 4 or 8");
    if (o.lanes & (o.lanes - 1)) refuse("lanes", v, "must be 1, 2, 4 or 8");
  };
  static const auto sort = [](O& o, const std::string& v) {
    o.sort = one_of<O::Sort>("sort", v,
                             {{"counting", O::Sort::counting}, {"thrust", O::Sort::thrust}});
  };
  static const auto capacity = [](O& o, const std::string& v) {
    o.capacity = number("capacity", v, 1, 4096, "must be in 1 … 4096 entries a particle");
  };
  static const auto launch = [](O& o, const std::string& v) {
    o.launch = one_of<O::Launch>(
        "launch", v,
        {{"auto", O::Launch::automatic}, {"graphs", O::Launch::graphs}, {"plain", O::Launch::plain}});
  };
  static const std::map<std::string, std::map<std::string, Setter>> known = {
      {"hash",
       {{"grid",
         [](O& o, const std::string& v) {
           o.grid = one_of<O::Grid>("grid", v, {{"all", O::Grid::all}, {"fluid", O::Grid::fluid}});
         }},
        {"source",
         [](O& o, const std::string& v) {
           o.source = one_of<O::Source>(
               "source", v, {{"frame", O::Source::frame}, {"rebuilt", O::Source::rebuilt}});
         }},
        {"pairs",
         [](O& o, const std::string& v) {
           o.pairs = one_of<O::Pairs>("pairs", v,
                                      {{"keep", O::Pairs::keep}, {"rescan", O::Pairs::rescan}});
         }},
        {"sort", sort},
        {"lanes", lanes},
        {"capacity", capacity},
        {"launch", launch}}},
      {"list",
       {{"build",
         [](O& o, const std::string& v) {
           o.build = one_of<O::Build>(
               "build", v, {{"grid", O::Build::grid}, {"all-pairs", O::Build::all_pairs}});
         }},
        {"rebuild",
         [](O& o, const std::string& v) {
           o.rebuild = v == "auto" ? 0
                                   : number("rebuild", v, 1, 1000000,
                                            "must be auto or a number of substeps >= 1");
         }},
        {"skin",
         [](O& o, const std::string& v) {
           o.skin = v == "auto"
                        ? -1
                        : number("skin", v, 0.0, 1.0, "must be auto or in 0 … 1, a share of H");
         }},
        {"trigger",
         [](O& o, const std::string& v) {
           o.trigger = one_of<O::Trigger>(
               "trigger", v, {{"local", O::Trigger::local}, {"global", O::Trigger::global}});
         }},
        {"verify",
         [](O& o, const std::string& v) {
           o.verify = one_of<bool>("verify", v, {{"off", false}, {"on", true}});
         }},
        {"lanes", lanes},
        {"capacity", capacity},
        {"launch", launch}}},
  };
  return known;
}

}  // namespace

SolverOptions parse_options(const std::string& backend, const std::string& text) {
  SolverOptions options;
  static const std::map<std::string, Setter> none;
  const auto entry = known_options().find(backend);
  const auto& keys = entry == known_options().end() ? none : entry->second;
  std::set<std::string> seen;
  for (std::size_t at = 0; at < text.size();) {
    const auto end = std::min(text.find(':', at), text.size());
    const std::string item = text.substr(at, end - at);
    const auto equals = item.find('=');
    const std::string key = item.substr(0, equals);
    const auto setter = keys.find(key);
    if (equals == std::string::npos || setter == keys.end()) {
      std::string known;
      for (const auto& [name, set] : keys) known += (known.empty() ? "" : ", ") + name;
      throw InputError("command line", "--backend", backend + ":" + item,
                       known.empty() ? backend + " takes no options"
                                     : "key=value, keys of " + backend + ": " + known);
    }
    if (!seen.insert(key).second) refuse(key, item, "given once");
    setter->second(options, item.substr(equals + 1));
    at = end + 1;
  }
  if (options.rebuild == 0 && options.skin >= 0 && options.skin < 0.01)
    refuse("skin", text, "at least 0.01 where --rebuild is auto: without skin every move is too far");
  return options;
}

}  // namespace decant::gpu
