/// \file
/// Backends over ranks: rank 0 runs the command and its calls, the others wait for what it asks of all. To its
/// callers a solver over ranks is a solver like any other.
#pragma once

#include "gpu/options.hpp"
#include "gpu/solver/device_solver.hpp"

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace decant::gpu {

/// What to make a rank's solver of. Trivially copyable, so that it can be sent.
struct SolverChoice {
  char backend[16];  // name in the table, ends with 0
  int cuda;          // executor: 0 host, 1 cuda
  SolverOptions options;
};

/// The solver of a choice; throws BackendError where there is none.
using MakeSolver = std::function<std::unique_ptr<DeviceSolver>(const SolverChoice&)>;

/// A rank's share of a state.
struct Share {
  std::vector<float> position, velocity;
  std::vector<int> id;
};

/// One rank's solvers, and how it does what is asked of all ranks.
class RankSide {
 public:
  RankSide(Communicator& ranks, MakeSolver make) : ranks_(ranks), make_(std::move(make)) {}

  /// Does its part of a request, the same bytes on all ranks; what it has to say to rank 0. `shares`: what rank 0
  /// wants loaded, by rank, null elsewhere. Throws what its solver throws.
  Bytes perform(const Bytes& request, std::vector<Share>* shares = nullptr);
  /// Of any rank but 0: does what rank 0 asks until that is to end. Failures are told to all.
  void serve() noexcept;
  DeviceSolver& solver(int number) { return *solvers_.at(number); }

 private:
  Communicator& ranks_;
  MakeSolver make_;
  std::map<int, std::unique_ptr<DeviceSolver>> solvers_;
};

/// The ranks as rank 0 sees them. One caller at a time; solvers keep it alive, and the other ranks end with it.
class RankTeam {
 public:
  /// \param others  threads that are the other ranks; none where those are processes
  RankTeam(std::unique_ptr<Communicator> ranks, const MakeSolver& make, std::vector<std::thread> others = {});
  ~RankTeam();
  RankTeam(const RankTeam&) = delete;
  RankTeam& operator=(const RankTeam&) = delete;
  int size() const { return ranks_->size(); }

  /// Asks all ranks; what each has to say, by rank. Throws BackendError once any rank has failed.
  std::vector<Bytes> ask(const Bytes& request, std::vector<Share>* shares = nullptr);
  DeviceSolver& own_solver(int number) { return own_.solver(number); }
  int next_number() { return next_++; }

 private:
  std::unique_ptr<Communicator> ranks_;
  RankSide own_;
  std::vector<std::thread> others_;
  std::mutex mutex_;
  std::atomic<int> next_ = 0;
};

/// Ranks that are threads of this process. On cuda rank k takes device k, and where there are fewer the next again.
std::shared_ptr<RankTeam> make_thread_team(int ranks, const MakeSolver& make);

/// A solver on all ranks of a team.
std::unique_ptr<DeviceSolver> make_on_ranks(std::shared_ptr<RankTeam> team, const SolverChoice& choice);

}  // namespace decant::gpu
