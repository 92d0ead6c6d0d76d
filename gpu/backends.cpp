/// \file
/// The table of backends, and the host side they share: scene data in, id-ordered Eigen data out.
#include "gpu/backends.hpp"

#include "gpu/ranks/mpi_communicator.hpp"
#include "gpu/ranks/nccl_exchange.hpp"
#include "gpu/solver/rank_team.hpp"
#include "reference/error.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <tbb/parallel_invoke.h>

#include <csignal>
#include <functional>
#include <optional>
#include <span>

namespace decant {
namespace {

using gpu::DeviceSolver;

struct Entry {
  const char* name;
  std::unique_ptr<DeviceSolver> (*host)(const gpu::SolverOptions&);
  std::unique_ptr<DeviceSolver> (*cuda)(const gpu::SolverOptions&);
};

#if DECANT_HAS_CUDA
#define DECANT_ENTRY(name) {#name, gpu::host::make_##name, gpu::cuda::make_##name},
#else
#define DECANT_ENTRY(name) {#name, gpu::host::make_##name, nullptr},
#endif

const Entry table[] = {DECANT_BACKENDS(DECANT_ENTRY)};

using FloatRows = Eigen::Matrix<float, 3, Eigen::Dynamic>;

std::vector<float> rows_of(const Eigen::Matrix3Xd& m) {
  const FloatRows rows = m.cast<float>();
  return {rows.data(), rows.data() + rows.size()};
}

Eigen::Matrix3Xd matrix_of(std::span<const float> rows) {
  return Eigen::Map<const FloatRows>(rows.data(), 3, static_cast<Eigen::Index>(rows.size() / 3)).cast<double>();
}

std::vector<float> values_of(const Eigen::VectorXd& v) {
  const Eigen::VectorXf values = v.cast<float>();
  return {values.data(), values.data() + values.size()};
}

Eigen::VectorXd vector_of(const std::vector<float>& values) {
  return Eigen::Map<const Eigen::VectorXf>(values.data(), static_cast<Eigen::Index>(values.size())).cast<double>();
}

IdVector ids_of(const std::vector<std::int64_t>& ids) {
  return Eigen::Map<const IdVector>(ids.data(), static_cast<Eigen::Index>(ids.size()));
}

/// A solver of the table.
std::unique_ptr<DeviceSolver> make_solver(const gpu::SolverChoice& choice) {
  for (const Entry& entry : table) {
    const auto make = choice.cuda ? entry.cuda : entry.host;
    if (choice.backend == std::string_view(entry.name) && make) return make(choice.options);
  }
  throw BackendError(std::string(choice.backend) + ": not in this build");
}

/// Of the one ProcessRanks that there can be, as there is one MPI.
std::weak_ptr<gpu::RankTeam>& process_team() {
  static std::weak_ptr<gpu::RankTeam> team;
  return team;
}

class DeviceBackend : public Backend {
 public:
  DeviceBackend(std::string name, Executor executor, std::string options, std::unique_ptr<DeviceSolver> solver)
      : name_(std::move(name)), executor_(executor), options_(std::move(options)), solver_(std::move(solver)) {}

  BackendInfo info() const override {
    return {name_, options_, executor_ == Executor::cuda ? "cuda" : "host", executor_device(executor_), "fp32"};
  }

  void load(const Scene& scene, const Walls& walls, const ParticleState& state) override {
    scene_ = scene;
    substep_ = state.substep;
    gpu::Problem problem{gpu::make_constants(scene),           gpu::make_geometry(scene), gpu::make_region(scene),
                         gpu::make_wall_samples(scene, walls), rows_of(state.position),   rows_of(state.velocity)};
    solver_->load(problem);
  }

  Status evaluate(Fields& out, const StageInputs* given) override {
    gpu::GivenInputs inputs;
    if (given) inputs = {values_of(given->boundary_volume), values_of(given->density), values_of(given->pressure)};
    gpu::HostFields fields;
    Status status = solver_->evaluate(gpu::make_poses(scene(), substep_, 1), inputs, fields);
    // As many values as a frame file holds: side by side, since a pour asks for them at every frame.
    tbb::parallel_invoke([&] { out.boundary_volume = vector_of(fields.boundary_volume); },
                         [&] {
                           out.density = vector_of(fields.density);
                           out.pressure = vector_of(fields.pressure);
                         },
                         [&] { out.pressure_acceleration = matrix_of(fields.pressure_acceleration); },
                         [&] { out.viscous_acceleration = matrix_of(fields.viscous_acceleration); },
                         [&] { out.wall_pressure_acceleration = matrix_of(fields.wall_pressure_acceleration); },
                         [&] { out.wall_viscous_acceleration = matrix_of(fields.wall_viscous_acceleration); },
                         [&] { out.acceleration = matrix_of(fields.acceleration); },
                         [&] {
                           out.fluid_neighbor_count = ids_of(fields.fluid_count);
                           out.fluid_neighbor_id_sum = ids_of(fields.fluid_id_sum);
                           out.wall_neighbor_count = ids_of(fields.wall_count);
                           out.wall_neighbor_id_sum = ids_of(fields.wall_id_sum);
                         });
    if (out.fluid_neighbor_count.size() > 0) {
      mean_fluid_ = out.fluid_neighbor_count.cast<double>().mean();
      mean_wall_ = out.wall_neighbor_count.cast<double>().mean();
    }
    if (!status.ok()) status.substep += substep_;
    return status;
  }

  Status evaluate_density(Fields& out) override {
    gpu::HostFields fields;
    Status status = solver_->evaluate_density(gpu::make_poses(scene(), substep_, 1), fields);
    out.density = vector_of(fields.density);
    out.pressure = vector_of(fields.pressure);
    if (!status.ok()) status.substep += substep_;
    return status;
  }

  Status advance(int substeps) override {
    Status status = solver_->advance(substeps, gpu::make_poses(scene(), substep_, substeps + 1));
    if (!status.ok()) status.substep += substep_;
    substep_ += substeps;
    return status;
  }

  void read(ParticleState& out) const override {
    const gpu::StateRows rows = solver_->read();
    out.substep = substep_;
    tbb::parallel_invoke([&] { out.position = matrix_of(rows.position); },
                         [&] { out.velocity = matrix_of(rows.velocity); });
  }

  StageTimes stage_times() const override { return solver_->stage_times(); }
  NeighborStats neighbor_stats() const override {
    NeighborStats stats = solver_->neighbor_stats();
    stats.mean_fluid = mean_fluid_;
    stats.mean_wall = mean_wall_;
    return stats;
  }

 private:
  const Scene& scene() const {
    if (!scene_) throw BackendError(name_ + ": nothing is loaded");
    return *scene_;
  }

  std::string name_;
  Executor executor_;
  std::string options_;
  std::unique_ptr<DeviceSolver> solver_;
  std::optional<Scene> scene_;
  std::int64_t substep_ = 0;
  double mean_fluid_ = 0, mean_wall_ = 0;  // neighbors a particle at the last evaluation
};

}  // namespace

ProcessRanks::ProcessRanks() : others_(gpu::mpi_communicator()) {
  if (!others_) return;
#if DECANT_HAS_CUDA
  gpu::cuda::use_device(gpu::rank_on_this_machine(*others_));
#endif
  if (others_->rank() != 0) return;
  team_ = std::make_shared<gpu::RankTeam>(std::move(others_), make_solver);
  process_team() = team_;
}
ProcessRanks::~ProcessRanks() = default;

bool ProcessRanks::serve() {
  if (!others_) return false;
  // Rank 0 decides what becomes of a stop; mpirun sends it to all.
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_IGN);
  gpu::RankSide(*others_, make_solver).serve();
  return true;
}

std::string mpi_version() { return gpu::mpi_version(); }
std::string nccl_version() {
#if DECANT_HAS_CUDA
  return gpu::cuda::nccl_version();
#else
  return "none";
#endif
}

std::vector<std::string> backend_names() {
  std::vector<std::string> names;
  for (const Entry& entry : table) names.emplace_back(entry.name);
  return names;
}

bool executor_available(Executor executor, std::string* why_not) {
  if (executor == Executor::host) return true;
#if DECANT_HAS_CUDA
  return !gpu::cuda::device(why_not).empty();
#else
  if (why_not) *why_not = "built without a CUDA toolkit";
  return false;
#endif
}

std::string executor_device(Executor executor) {
#if DECANT_HAS_CUDA
  if (executor == Executor::cuda) return gpu::cuda::device(nullptr);
#endif
  return executor == Executor::host ? gpu::host::device() : std::string();
}

void start_profiler() {
#if DECANT_HAS_CUDA
  if (executor_available(Executor::cuda)) gpu::cuda::start_profiler();
#endif
}

std::string thrust_version() { return gpu::host::thrust_version(); }

std::unique_ptr<Backend> backend_around(std::string name, Executor executor, std::string options,
                                        std::unique_ptr<DeviceSolver> solver) {
  return std::make_unique<DeviceBackend>(std::move(name), executor, std::move(options), std::move(solver));
}

std::unique_ptr<Backend> make_backend(std::string_view name, Executor executor, const std::string& options) {
  for (const Entry& entry : table) {
    if (name != entry.name) continue;
    const gpu::SolverOptions parsed = gpu::parse_options(entry.name, options);
    std::string why_not;
    if (!executor_available(executor, &why_not)) throw BackendError("executor cuda: " + why_not);
    gpu::SolverChoice choice{{}, executor == Executor::cuda, parsed};
    name.copy(choice.backend, sizeof choice.backend - 1);
    auto team = gpu::takes_option(entry.name, "ranks") ? process_team().lock() : nullptr;
    if (team && parsed.ranks != 1)
      throw InputError("command line", "--backend", std::string(name) + ":" + options,
                       "without ranks under mpirun, whose processes are the ranks");
    if (parsed.ranks != 1) team = gpu::make_thread_team(parsed.ranks, make_solver);
    std::string told = options;
    if (team && parsed.ranks == 1) told += (told.empty() ? "ranks=" : ":ranks=") + std::to_string(team->size());
    return backend_around(entry.name, executor, told,
                          team ? make_on_ranks(std::move(team), choice) : make_solver(choice));
  }
  std::string known;
  for (const Entry& entry : table) known += (known.empty() ? "" : ", ") + std::string(entry.name);
  throw InputError("command line", "--backend", std::string(name), "one of " + known);
}

}  // namespace decant
