/// \file
/// Looks names up and asks executors whether they are there.
#include "tools/backend_choice.hpp"

#include "gpu/backends.hpp"
#include "oracle/reference_backend.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace decant {
namespace {

[[noreturn]] void refuse(const char* option, const std::string& value, const std::string& bound) {
  throw InputError("command line", option, value, bound);
}

struct BackendFlag {
  const char *backend, *key, *help;
};
constexpr BackendFlag backend_flags[] = {
    {"hash", "grid", "all or fluid: what has cells"},
    {"hash", "source", "frame or rebuilt: how moving walls are looked up"},
    {"hash", "sort", "counting or thrust"},
    {"hash", "pairs", "keep or rescan: what the force pass reads"},
    {"list", "build", "grid or all-pairs"},
    {"list", "rebuild", "auto, or every so many substeps"},
    {"list", "trigger", "global or local: what --rebuild auto watches"},
    {"list", "skin", "auto, or a share of H"},
};

Executor executor_of(const std::string& name) {
  if (name != "auto" && name != "cuda" && name != "host")
    refuse("--executor", name, "must be auto, cuda or host");
  if (name == "host") return Executor::host;
  std::string why_not;
  if (executor_available(Executor::cuda, &why_not)) return Executor::cuda;
  if (name == "cuda") throw DeviceAbsent("executor cuda is not available: " + why_not);
  return Executor::host;
}

}  // namespace

void BackendFlags::add_to(CLI::App& verb) {
  for (const BackendFlag& flag : backend_flags)
    verb.add_option_function<std::string>(
            std::string("--") + flag.key,
            [this, key = std::string(flag.key)](const std::string& value) { given[key] = value; },
            flag.help)
        ->group("Options of backends");
}

std::string BackendFlags::applied_to(const std::string& choice) {
  std::string all = choice;
  for (const BackendFlag& flag : backend_flags) {
    const auto value = given.find(flag.key);
    if (value == given.end() || choice.substr(0, choice.find(':')) != flag.backend) continue;
    all += std::string(":") + flag.key + "=" + value->second;
    ++used_[flag.key];
  }
  return all;
}

void BackendFlags::require_used() const {
  for (const BackendFlag& flag : backend_flags)
    if (given.count(flag.key) && !used_.count(flag.key))
      refuse((std::string("--") + flag.key).c_str(), given.at(flag.key),
             std::string("only with --backend ") + flag.backend);
}

std::vector<std::string> backend_choices() {
  std::vector<std::string> names = backend_names();
  names.insert(names.begin(), "reference");
  return names;
}

std::unique_ptr<Backend> choose_backend(const std::string& choice, const std::string& executor) {
  const auto colon = choice.find(':');
  const std::string name = choice.substr(0, colon);
  const std::string options = colon == std::string::npos ? "" : choice.substr(colon + 1);
  const auto choices = backend_choices();
  if (std::find(choices.begin(), choices.end(), name) == choices.end())
    refuse("--backend", name, fmt::format("must be one of {}", fmt::join(choices, ", ")));
  if (name != "reference") return make_backend(name, executor_of(executor), options);
  if (executor == "cuda") refuse("--executor", executor, "the reference runs on the host only");
  if (executor != "auto" && executor != "host") (void)executor_of(executor);
  if (!options.empty() && options != "all-pairs")
    refuse("--backend", choice, "reference or reference:all-pairs");
  return make_reference_backend(options.empty() ? NeighborSearch::cells
                                                : NeighborSearch::all_pairs);
}

}  // namespace decant
