/// \file
/// Backends over ranks: rank 0 runs the command and its calls, the others wait for what it asks of all. To its
/// callers a solver over ranks is a solver like any other.
#pragma once

#include "gpu/options.hpp"
#include "gpu/solver/device_solver.hpp"

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace decant::gpu {

/// What to make a rank's solver of. Trivially copyable, so that it can be sent.
struct SolverChoice {
  char backend[16];  // name in the table, ends with 0
  int cuda;          // executor: 0 host, 1 cuda
  SolverOptions options;
};

/// The solver of a choice; throws BackendError where there is none.
using MakeSolver = std::function<std::unique_ptr<DeviceSolver>(const SolverChoice&)>;

/// One rank's solvers, and how it does what is asked of all ranks.
class RankSide {
 public:
  RankSide(Communicator& ranks, MakeSolver make) : ranks_(ranks), make_(std::move(make)) {}

  /// Does its part of a request, the same bytes on all ranks; what it has to say to rank 0. `problem`: what rank 0
  /// wants loaded, null elsewhere. Throws what its solver throws.
  Bytes perform(const Bytes& request, const Problem* problem = nullptr);
  /// Of any rank but 0: does what rank 0 asks until that is to end. Failures are told to all.
  void serve() noexcept;
  DeviceSolver& solver(int number) { return *solvers_.at(number); }

 private:
  Communicator& ranks_;
  MakeSolver make_;
  std::map<int, std::unique_ptr<DeviceSolver>> solvers_;
};

/// The ranks as rank 0 sees them. One caller at a time; solvers keep it alive.
class RankTeam {
 public:
  virtual ~RankTeam() = default;
  int size() const { return ranks().size(); }

  /// Asks all ranks; what each has to say, by rank. Throws BackendError once any rank has failed.
  std::vector<Bytes> ask(const Bytes& request, const Problem* problem = nullptr);
  DeviceSolver& own_solver(int number) { return own().solver(number); }
  int next_number() { return next_++; }

 protected:
  virtual Communicator& ranks() const = 0;
  virtual RankSide& own() = 0;
  /// The other ranks end.
  void dismiss() noexcept;

 private:
  std::mutex mutex_;
  int next_ = 0;
};

/// Ranks that are threads of this process. On cuda rank k takes device k, and where there are fewer the next again.
std::shared_ptr<RankTeam> make_thread_team(int ranks, MakeSolver make);

/// Ranks that are processes, of which this is rank 0.
std::shared_ptr<RankTeam> make_process_team(std::unique_ptr<Communicator> ranks, MakeSolver make);

/// A solver on all ranks of a team.
std::unique_ptr<DeviceSolver> make_on_ranks(std::shared_ptr<RankTeam> team, const SolverChoice& choice);

}  // namespace decant::gpu
