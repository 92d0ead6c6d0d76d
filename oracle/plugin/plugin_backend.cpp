/// \file
/// The side of the command: starts the process, asks, and says what became of it.
#include "oracle/plugin/plugin_backend.hpp"

#include "oracle/plugin.h"
#include "oracle/plugin/message.hpp"
#include "reference/error.hpp"
#include "reference/state.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <system_error>
#include <utility>

extern char** environ;

namespace decant {
namespace {

template <class... Ours>
constexpr bool same(std::initializer_list<std::uint32_t> theirs, Ours... ours) {
  return std::ranges::equal(theirs, std::initializer_list<std::uint32_t>{static_cast<std::uint32_t>(ours)...});
}
static_assert(same({DECANT_OFFERS_DENSITY, DECANT_OFFERS_ACCELERATION, DECANT_OFFERS_PARTS, DECANT_OFFERS_NEIGHBORS,
                    DECANT_OFFERS_GIVEN, DECANT_OFFERS_BOUNDARY_VOLUME, DECANT_OFFERS_WALLS, DECANT_OFFERS_STEP,
                    DECANT_OFFERS_STATUS},
                   Offer::density, Offer::acceleration, Offer::parts, Offer::neighbors, Offer::given,
                   Offer::boundary_volume, Offer::walls, Offer::step, Offer::status));
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

struct Socket {
  int fd = -1;
  explicit Socket(int number = -1) : fd(number) {}
  Socket(Socket&& other) noexcept : fd(std::exchange(other.fd, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(fd, other.fd);
    return *this;
  }
  ~Socket() {
    if (fd >= 0) ::close(fd);
  }
};

/// The process of a plug-in.
class Process {
 public:
  Process(const std::string& path, const std::string& options) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
      throw BackendError(fmt::format("plug-in {}: no socket: {}", path, std::strerror(errno)));
    Socket ours(ends[0]), theirs(ends[1]);
    const std::string program = host_program().string();
    const std::string number = std::to_string(plugin_socket);
    std::array<char*, 4> arguments{const_cast<char*>(program.c_str()), const_cast<char*>(path.c_str()),
                                   const_cast<char*>(options.c_str()), nullptr};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, theirs.fd, plugin_socket);
    const int error = ::posix_spawn(&id_, program.c_str(), &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throw BackendError(fmt::format("{}: {}", program, std::strerror(error)));
    socket_ = std::move(ours);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() { end(); }

  int socket() const { return socket_.fd; }

  /// Kills it if it still runs; "was ended by signal 11 (Segmentation fault)".
  std::string end() {
    if (id_ <= 0) return "has ended";
    // What is about to end by itself says how.
    int status = 0;
    pid_t ended = 0;
    for (int wait = 0; wait < 20 && (ended = ::waitpid(id_, &status, WNOHANG)) == 0; ++wait) ::usleep(wait_us);
    if (ended == 0) {
      ::kill(id_, SIGKILL);
      ::waitpid(id_, &status, 0);
      id_ = -1;
      return "was ended";
    }
    id_ = -1;
    if (WIFSIGNALED(status))
      return fmt::format("was ended by signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)));
    return fmt::format("left with exit status {}", WEXITSTATUS(status));
  }
  void kill() {
    if (id_ > 0) ::kill(id_, SIGKILL);
  }

  static constexpr int plugin_socket = 3;

 private:
  static constexpr unsigned wait_us = 5000;
  pid_t id_ = -1;
  Socket socket_;
};

decant_scene flat_scene(const Scene& scene) {
  decant_scene s{};
  s.size = sizeof s;
  s.kernel = static_cast<std::int32_t>(scene.kernel);
  s.particle_spacing = scene.particle_spacing;
  s.support_radius = scene.support_radius();
  s.particle_mass = scene.particle_mass();
  s.rest_density = scene.fluid.rest_density;
  s.sound_speed = scene.fluid.sound_speed;
  s.eos_exponent = scene.fluid.eos_exponent;
  s.eos_stiffness = scene.eos_stiffness();
  s.allow_tension = scene.fluid.allow_tension;
  s.viscosity = scene.fluid.viscosity;
  s.wall_viscosity = scene.fluid.wall_viscosity;
  for (int k = 0; k < 3; ++k) {
    s.gravity[k] = scene.gravity[k];
    s.domain_min[k] = scene.domain.min[k];
    s.domain_max[k] = scene.domain.max[k];
    s.periodic[k] = scene.domain.periodic[static_cast<std::size_t>(k)];
  }
  s.has_floor = scene.floor.has_value();
  s.floor_height = scene.floor ? scene.floor->height : 0;
  s.contact_distance = scene.contact_distance();
  s.restitution = scene.contact.restitution;
  s.friction = scene.contact.friction;
  s.time_step = scene.time_step();
  s.containers = static_cast<std::int32_t>(scene.containers.size());
  return s;
}

class PluginBackend : public Backend {
 public:
  PluginBackend(std::string path, std::string options, double limit)
      : path_(std::move(path)), options_(std::move(options)), limit_(limit) {
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
    for (auto* values : {&out.boundary_volume, &out.density, &out.pressure}) pack(in, *values);
    for (auto* values : {&out.acceleration, &out.pressure_acceleration, &out.viscous_acceleration,
                         &out.wall_pressure_acceleration, &out.wall_viscous_acceleration})
      pack(in, *values);
    for (auto* values :
         {&out.fluid_neighbor_count, &out.fluid_neighbor_id_sum, &out.wall_neighbor_count, &out.wall_neighbor_id_sum})
      pack(in, *values);
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

  StageTimes stage_times() const override { return {}; }
  NeighborStats neighbor_stats() const override {
    NeighborStats stats = stats_;
    stats.device_bytes = bytes_;
    return stats;
  }

 private:
  std::string name() const { return "plug-in " + path_; }
  void require_loaded() const {
    if (!loaded_) throw BackendError(name() + ": nothing is loaded");
    if (!process_) throw BackendError(name() + " is not there any more");
  }

  void start() {
    process_ = std::make_unique<Process>(path_, options_);
    Message hello;
    try {
      hello = plugin::receive(process_->socket(), std::chrono::duration<double>(limit_));
    } catch (const plugin::Silence& silence) {
      lose(silence, "start");
    }
    if (hello.code != Code::done) {
      process_.reset();
      throw InputError("command line", "--backend", "plugin:" + path_, hello.bytes);
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

  std::string path_, options_;
  double limit_;
  mutable std::unique_ptr<Process> process_;
  BackendInfo info_;
  std::uint32_t offers_ = 0;
  bool loaded_ = false;
  std::int64_t substep_ = 0;
  Eigen::Index particles_ = 0;
  std::int64_t bytes_ = 0;
  NeighborStats stats_;
};

}  // namespace

std::unique_ptr<Backend> make_plugin_backend(const std::string& choice) {
  const auto refuse = [&](const std::string& why) {
    throw InputError("command line", "--backend", "plugin:" + choice, why);
  };
  std::string path = choice.substr(0, choice.find(':')), options;
  double limit = plugin_time_limit;
  for (std::size_t at = path.size(); at < choice.size();) {
    const std::size_t end = std::min(choice.find(':', at + 1), choice.size());
    const std::string option = choice.substr(at + 1, end - at - 1);
    at = end;
    const std::string key = option.substr(0, option.find('='));
    if (key.empty() || key.size() == option.size()) refuse("options are key=value");
    if (key != "time_limit") {
      options += (options.empty() ? "" : ":") + option;
      continue;
    }
    char* rest = nullptr;
    const std::string value = option.substr(key.size() + 1);
    limit = std::strtod(value.c_str(), &rest);
    if (value.empty() || *rest != '\0' || !(limit > 0 && limit <= 1e6)) refuse("time_limit is in (0, 1e6] s");
  }
  if (path.empty()) refuse("plugin:PATH of a shared library");
  std::error_code none;
  if (!fs::is_regular_file(path, none)) refuse("a shared library (oracle/plugin/README.md)");
  return std::make_unique<PluginBackend>(fs::absolute(path).string(), options, limit);
}

}  // namespace decant
