/// \file
/// The side of the command: starts the process, asks, and says what became of it.
#include "oracle/plugin/plugin_backend.hpp"

#include "oracle/lists/given_lists.hpp"
#include "oracle/plugin.h"
#include "oracle/plugin/field_table.hpp"
#include "oracle/plugin/flat_scene.hpp"
#include "oracle/plugin/message.hpp"
#include "oracle/plugin/process.hpp"
#include "reference/error.hpp"
#include "reference/neighbors.hpp"
#include "reference/state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <system_error>
#include <utility>

namespace decant {
namespace {

template <class... Ours>
constexpr bool same(std::initializer_list<std::uint32_t> theirs, Ours... ours) {
  return std::ranges::equal(theirs, std::initializer_list<std::uint32_t>{static_cast<std::uint32_t>(ours)...});
}
static_assert(same({DECANT_OFFERS_DENSITY, DECANT_OFFERS_ACCELERATION, DECANT_OFFERS_PARTS, DECANT_OFFERS_NEIGHBORS,
                    DECANT_OFFERS_GIVEN, DECANT_OFFERS_BOUNDARY_VOLUME, DECANT_OFFERS_WALLS, DECANT_OFFERS_STEP,
                    DECANT_OFFERS_STATUS, DECANT_OFFERS_LISTS, DECANT_OFFERS_REBUILD},
                   Offer::density, Offer::acceleration, Offer::parts, Offer::neighbors, Offer::given,
                   Offer::boundary_volume, Offer::walls, Offer::step, Offer::status, Offer::lists, Offer::rebuild));
static_assert(same({DECANT_NON_FINITE, DECANT_ESCAPED, DECANT_CAPACITY, DECANT_MISSED_PAIR}, Status::non_finite,
                   Status::escaped, Status::capacity, Status::missed_pair));

namespace fs = std::filesystem;
using plugin::Code;
using plugin::Message;
using plugin::Packer;
using plugin::Unpacker;

/// Beside the running program, where builds and installations put it.
fs::path host_program() {
  if (const char* named = std::getenv("DECANT_PLUGIN_HOST")) return named;
  std::error_code none;
  const fs::path beside = fs::read_symlink("/proc/self/exe", none).parent_path() / "decant-plugin-host";
  if (!fs::exists(beside, none))
    throw BackendError(beside.string() + ": not found; DECANT_PLUGIN_HOST may say where it is");
  return beside;
}

/// What to start, and what to call it.
struct Start {
  std::string called;  // "plugin:PATH", for people
  std::string program;
  std::vector<std::string> arguments;  // and the options
};

class PluginBackend : public Backend {
 public:
  PluginBackend(Start how, std::string options, double limit)
      : how_(std::move(how)), options_(std::move(options)), limit_(limit) {
    how_.arguments.push_back(options_);
    start();
  }

  BackendInfo info() const override { return info_; }
  std::uint32_t offers() const override { return offers_; }

  void load(const Scene& scene, const Walls& walls, const ParticleState& state) override {
    if (!process_) start();
    Packer out;
    decant_scene flat = flat_scene(scene);
    out(flat);
    for (Container container : scene.containers) pack(out, container);
    Eigen::Matrix3Xd position(3, walls.size());
    std::vector<std::int32_t> container;
    Eigen::Index at = 0;
    for (std::size_t k = 0; k < walls.containers.size(); ++k) {
      const auto& particles = walls.containers[k].position;
      position.middleCols(at, particles.cols()) = particles;
      at += particles.cols();
      container.resize(static_cast<std::size_t>(at), static_cast<std::int32_t>(k));
    }
    pack(out, position);
    pack(out, container);
    ParticleState copy = state;
    out(copy.substep);
    pack(out, copy.position);
    pack(out, copy.velocity);
    substep_ = state.substep;
    particles_ = state.size();
    wall_particles_ = walls.size();
    loaded_ = true;
    (void)ask(Code::load, std::move(out.bytes), "load");
  }

  Status evaluate(Fields& out, const StageInputs* given) override {
    require_loaded();
    Packer request;
    StageInputs inputs = given ? *given : StageInputs{};
    request(given != nullptr);
    for (auto* values : {&inputs.boundary_volume, &inputs.density, &inputs.pressure}) pack(request, *values);
    const std::string answer = ask(Code::evaluate, std::move(request.bytes), "evaluate");
    Unpacker in(answer);
    const Status status = status_of(in);
    for (const plugin::RealField& field : plugin::real_fields) {
      if (field.scalar) pack(in, out.*field.scalar);
      else pack(in, out.*field.vector);
    }
    for (const plugin::CountField& field : plugin::count_fields) pack(in, out.*field.ours);
    in(bytes_);
    if ((offers_ & Offer::neighbors) && out.fluid_neighbor_count.size() > 0) {
      stats_.mean_fluid = out.fluid_neighbor_count.cast<double>().mean();
      stats_.mean_wall = out.wall_neighbor_count.cast<double>().mean();
    }
    return status;
  }

  Status advance(int substeps) override {
    require_loaded();
    if (!(offers_ & Offer::step)) throw BackendError(name() + " does not offer to advance");
    Packer request;
    request(std::int64_t{substeps});
    const std::string answer = ask(Code::advance, std::move(request.bytes), fmt::format("advance by {}", substeps));
    Unpacker in(answer);
    const Status status = status_of(in);
    in(bytes_);
    substep_ += substeps;
    return status;
  }

  void read(ParticleState& out) const override {
    require_loaded();
    const std::string answer = ask(Code::read, {}, "read");
    Unpacker in(answer);
    out.substep = substep_;
    pack(in, out.position);
    pack(in, out.velocity);
  }

  StageTimes stage_times() const override {
    const decant_stage_times t = times();
    return {{t.build, t.build_calls},
            {t.density, t.density_calls},
            {t.force, t.force_calls},
            {t.integrate, t.integrate_calls}};
  }
  NeighborStats neighbor_stats() const override {
    NeighborStats stats = stats_;
    stats.device_bytes = bytes_;
    stats.rebuilds = times().rebuilds;
    return stats;
  }

  std::int64_t lists(Neighbors& out) const override {
    require_loaded();
    if (!(offers_ & Offer::lists)) return Backend::lists(out);
    const std::string answer = ask(Code::lists, {}, "lists");
    Unpacker in(answer);
    std::int64_t built = -1;
    in(built);
    const auto read = [&](const char* which, std::int64_t targets, bool of_fluid) {
      std::vector<std::int64_t> offsets;
      std::vector<std::int32_t> entries;
      pack(in, offsets);
      pack(in, entries);
      const RefuseList refuse = [&](const char* part, const std::string& value, const std::string& bound) {
        throw BackendError(
            fmt::format("{}, lists at substep {}, {}{}: {}; {}", name(), substep_, which, part, value, bound));
      };
      IdVector count(static_cast<Eigen::Index>(offsets.size()) - 1);
      for (Eigen::Index i = 0; i < count.size(); ++i)
        count[i] = offsets[static_cast<std::size_t>(i) + 1] - offsets[static_cast<std::size_t>(i)];
      (void)checked_entries(count, targets, refuse);
      IdVector ids(static_cast<Eigen::Index>(entries.size()));
      std::copy(entries.begin(), entries.end(), ids.begin());
      return checked_lists(count, ids, targets, of_fluid, refuse);
    };
    out.fluid = read("fluid", particles_, true);
    out.wall = read("wall", wall_particles_, false);
    return built;
  }

 private:
  std::string name() const { return "plug-in " + how_.called.substr(how_.called.find(':') + 1); }
  void require_loaded() const {
    if (!loaded_) throw BackendError(name() + ": nothing is loaded");
    if (!process_) throw BackendError(name() + " is not there any more");
  }

  decant_stage_times times() const {
    decant_stage_times times{};
    if (!process_ || !loaded_) return times;
    const std::string answer = ask(Code::stage_times, {}, "stage_times");
    Unpacker in(answer);
    in(times);
    return times;
  }

  void start() {
    process_ = std::make_unique<plugin::Process>(how_.program, how_.arguments);
    Message hello;
    try {
      hello = plugin::receive(process_->socket(), std::chrono::duration<double>(limit_));
    } catch (const plugin::Silence& silence) {
      lose(silence, "start");
    }
    if (hello.code != Code::done) {
      process_.reset();
      throw InputError("command line", "--backend", how_.called, hello.bytes);
    }
    Unpacker in(hello.bytes);
    in(offers_);
    std::string called, precision, device;
    for (std::string* text : {&called, &precision, &device}) pack(in, *text);
    info_ = {called, options_, "plug-in", device.empty() ? "unknown device" : device, precision};
  }

  /// Request and answer. Throws BackendError where there is none, or says that the call failed.
  std::string ask(Code code, std::string bytes, const std::string& call) const {
    try {
      plugin::send(process_->socket(), {code, std::move(bytes)});
      Message answer = plugin::receive(process_->socket(), std::chrono::duration<double>(limit_));
      if (answer.code == Code::done) return std::move(answer.bytes);
      throw BackendError(fmt::format("{}, {}: {}", name(), call, answer.bytes));
    } catch (const plugin::Silence& silence) {
      lose(silence, call);
    }
  }
  [[noreturn]] void lose(const plugin::Silence& silence, const std::string& call) const {
    const std::string where =
        loaded_ ? fmt::format("{} at substep {}, {} particles", call, substep_, particles_) : call;
    if (silence.timed_out) {
      process_->kill();
      process_.reset();
      throw BackendError(fmt::format("{}, {}: no answer within {} s; ended", name(), where, limit_));
    }
    const std::string end = process_->end();
    process_.reset();
    throw BackendError(fmt::format("{}, {}: its process {}", name(), where, end));
  }

  static Status status_of(Unpacker& in) {
    Status status;
    in(status.bits);
    in(status.particle);
    in(status.substep);
    return status;
  }

  Start how_;
  std::string options_;
  double limit_;
  mutable std::unique_ptr<plugin::Process> process_;
  BackendInfo info_;
  std::uint32_t offers_ = 0;
  bool loaded_ = false;
  std::int64_t substep_ = 0;
  Eigen::Index particles_ = 0, wall_particles_ = 0;
  std::int64_t bytes_ = 0;
  NeighborStats stats_;
};

}  // namespace

namespace {

/// "WHAT:key=value:…": options from the first key on.
struct Choice {
  std::string what, options;
  double limit = plugin_time_limit;
};

/// \param names  parts between colons that come before the options
Choice parse(const char* kind, const std::string& choice, int names) {
  const auto refuse = [&](const std::string& why) {
    throw InputError("command line", "--backend", std::string(kind) + ":" + choice, why);
  };
  Choice out;
  std::size_t end = choice.find(':');
  for (int k = 1; k < names && end != std::string::npos; ++k) end = choice.find(':', end + 1);
  out.what = choice.substr(0, end);
  for (std::size_t at = out.what.size(); at < choice.size();) {
    end = std::min(choice.find(':', at + 1), choice.size());
    const std::string option = choice.substr(at + 1, end - at - 1);
    at = end;
    const std::string key = option.substr(0, option.find('='));
    if (key.empty() || key.size() == option.size()) refuse("options are key=value");
    std::string letters;
    for (const char c : key)
      if (std::isalpha(static_cast<unsigned char>(c))) letters += static_cast<char>(std::tolower(c));
    if (letters == "timelimit" && key != "time_limit") refuse(key + " is no option; did you mean time_limit?");
    if (key != "time_limit") {
      out.options += (out.options.empty() ? "" : ":") + option;
      continue;
    }
    char* rest = nullptr;
    const std::string value = option.substr(key.size() + 1);
    out.limit = std::strtod(value.c_str(), &rest);
    if (value.empty() || *rest != '\0' || !(out.limit > 0 && out.limit <= 1e6)) refuse("time_limit is in (0, 1e6] s");
  }
  return out;
}

}  // namespace

std::unique_ptr<Backend> make_plugin_backend(const std::string& choice) {
  const Choice chosen = parse("plugin", choice, 1);
  const auto refuse = [&](const std::string& why) {
    throw InputError("command line", "--backend", "plugin:" + choice, why);
  };
  if (chosen.what.empty()) refuse("plugin:PATH of a shared library");
  std::error_code none;
  if (!fs::exists(chosen.what, none)) refuse("a shared library (oracle/plugin/README.md); there is no such file");
  if (!fs::is_regular_file(chosen.what, none)) refuse("a shared library (oracle/plugin/README.md), not a folder");
  const std::string path = fs::absolute(chosen.what).string();
  return std::make_unique<PluginBackend>(Start{"plugin:" + path, host_program().string(), {path}}, chosen.options,
                                         chosen.limit);
}

std::unique_ptr<Backend> make_python_backend(const std::string& choice) {
  const Choice chosen = parse("python", choice, 2);
  const auto colon = chosen.what.find(':');
  if (colon == 0 || colon == std::string::npos || colon + 1 == chosen.what.size())
    throw InputError("command line", "--backend", "python:" + choice,
                     "python:FILE:CLASS or python:MODULE:CLASS, a class derived from decant.Port");
  const char* named = std::getenv("DECANT_PYTHON");
  return std::make_unique<PluginBackend>(
      Start{"python:" + chosen.what, named && *named ? named : "python3", {"-m", "decant.serve", chosen.what}},
      chosen.options, chosen.limit);
}

}  // namespace decant
