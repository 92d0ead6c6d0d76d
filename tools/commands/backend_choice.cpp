/// \file
/// Looks names up and asks executors whether they are there.
#include "tools/commands/backend_choice.hpp"

#include "gpu/backends.hpp"
#include "gpu/options.hpp"
#include "oracle/plugin/plugin_backend.hpp"
#include "oracle/solution/reference_backend.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

namespace decant {
namespace {

[[noreturn]] void refuse(const char* option, const std::string& value, const std::string& bound) {
  throw InputError("command line", option, value, bound);
}

/// wall_cells -> --wall-cells
std::string flag_of(std::string key) {
  std::replace(key.begin(), key.end(), '_', '-');
  return "--" + key;
}

Executor executor_of(const std::string& name) {
  if (name != "auto" && name != "cuda" && name != "host") refuse("--executor", name, "must be auto, cuda or host");
  if (name == "host") return Executor::host;
  std::string why_not;
  if (executor_available(Executor::cuda, &why_not)) return Executor::cuda;
  if (name == "cuda") throw DeviceAbsent("executor cuda is not available: " + why_not);
  return Executor::host;
}

}  // namespace

void BackendFlags::add_to(CLI::App& verb) {
  for (const gpu::OptionDescription& option : gpu::option_descriptions()) {
    if (!option.flag) continue;
    const auto take = [this, key = std::string(option.key)](const std::string& value) { given[key] = value; };
    verb.add_option_function<std::string>(flag_of(option.key), take,
                                          fmt::format("of {}: {}; {}", option.backends, option.values, option.help))
        ->group("Options of backends");
    if (std::string(option.key) != option.before)
      verb.add_option_function<std::string>(flag_of(option.before), take)->group("");  // hidden
  }
}

std::string BackendFlags::applied_to(const std::string& choice) {
  std::string all = choice;
  for (const gpu::OptionDescription& option : gpu::option_descriptions()) {
    const auto value = given.find(option.key);
    if (value == given.end() || choice.substr(0, choice.find(':')) != option.backends) continue;
    all += std::string(":") + option.key + "=" + value->second;
    ++used_[option.key];
  }
  return all;
}

void BackendFlags::require_used() const {
  for (const gpu::OptionDescription& option : gpu::option_descriptions())
    if (given.count(option.key) && !used_.count(option.key))
      refuse(flag_of(option.key).c_str(), given.at(option.key), std::string("only with --backend ") + option.backends);
}

std::vector<std::string> backend_choices() {
  std::vector<std::string> names = backend_names();
  names.insert(names.begin(), "reference");
  return names;
}

bool is_plugin(const std::string& choice) { return choice.starts_with("plugin:") || choice.starts_with("python:"); }

void require_offers(const Backend& backend, const std::string& choice, const char* verb) {
  constexpr std::pair<std::uint32_t, const char*> needed[] = {{Offer::density, "DENSITY"},
                                                              {Offer::acceleration, "ACCELERATION"},
                                                              {Offer::walls, "WALLS"},
                                                              {Offer::step, "STEP"}};
  std::vector<std::string> missing;
  for (const auto& [bit, name] : needed)
    if (!(backend.offers() & bit)) missing.emplace_back(name);
  if (missing.empty()) return;
  refuse("--backend", choice,
         fmt::format("a plug-in that offers {}, which {} asks for", fmt::join(missing, ", "), verb));
}

bool names_backend(const std::string& choice) {
  const auto names = backend_choices();
  return is_plugin(choice) || std::ranges::find(names, choice.substr(0, choice.find(':'))) != names.end();
}

std::unique_ptr<Backend> choose_backend(const std::string& choice, const std::string& executor) {
  const auto colon = choice.find(':');
  const std::string name = choice.substr(0, colon);
  const std::string options = colon == std::string::npos ? "" : choice.substr(colon + 1);
  if (is_plugin(choice)) {
    if (executor != "auto") refuse("--executor", executor, "a plug-in runs on what it is built for");
    return name == "python" ? make_python_backend(options) : make_plugin_backend(options);
  }
  const auto choices = backend_choices();
  if (std::find(choices.begin(), choices.end(), name) == choices.end())
    refuse("--backend", name,
           fmt::format("must be one of {}, plugin:PATH, python:FILE:CLASS", fmt::join(choices, ", ")));
  if (name != "reference") return make_backend(name, executor_of(executor), options);
  if (executor == "cuda") refuse("--executor", executor, "the reference runs on the host only");
  if (executor != "auto" && executor != "host") (void)executor_of(executor);
  if (!options.empty() && options != "all-pairs") refuse("--backend", choice, "reference or reference:all-pairs");
  return make_reference_backend(options.empty() ? NeighborSearch::cells : NeighborSearch::all_pairs);
}

}  // namespace decant
