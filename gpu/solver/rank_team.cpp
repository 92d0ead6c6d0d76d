/// \file
/// Requests to all ranks and their answers. A particle's row is answered by the rank that owns it.
#include "gpu/solver/rank_team.hpp"

#include "gpu/ranks/partition.hpp"
#include "reference/error.hpp"

#include <omp.h>

#include <algorithm>
#include <limits>
#include <span>
#include <string>

namespace decant::gpu {
namespace {

enum class Request : int { make, drop, load, evaluate, evaluate_density, advance, read, stats, end };

Writer header(Request request, int number) {
  Writer writer;
  writer << request << number;
  return writer;
}

// All fields with a row per particle, and values per row.
template <class Fields, class Each>
void each_field(Fields& f, Each each) {
  each(f.density, 1);
  each(f.pressure, 1);
  for (auto* vectors : {&f.pressure_acceleration, &f.viscous_acceleration, &f.wall_pressure_acceleration,
                        &f.wall_viscous_acceleration, &f.acceleration})
    each(*vectors, 3);
  for (auto* counts : {&f.fluid_count, &f.fluid_id_sum, &f.wall_count, &f.wall_id_sum}) each(*counts, 1);
}

template <class T>
std::vector<T> owned_rows(std::span<const T> values, std::size_t width, const RankRows& rows) {
  std::vector<T> out;
  for (std::size_t k = 0; (k + 1) * width <= values.size(); ++k)
    if (rows.owned[k])
      out.insert(out.end(), values.begin() + static_cast<std::ptrdiff_t>(k * width),
                 values.begin() + static_cast<std::ptrdiff_t>((k + 1) * width));
  return out;
}
std::vector<int> owned_ids(const RankRows& rows) { return owned_rows(std::span(rows.id), 1, rows); }

/// All but the particles, of which each rank gets others.
void put_problem(Writer& to, const Problem& p, const std::vector<Box>& boxes) {
  to << p.constants << p.geometry.shapes << p.geometry.edges << p.geometry.boxes << p.geometry.faces << p.region;
  const std::vector<char> moves(p.walls.container_moves.begin(), p.walls.container_moves.end());
  to << p.walls.x << p.walls.y << p.walls.z << p.walls.container_begin << moves;
  to << static_cast<int>(p.position.size() / 3) << boxes;
}
Problem get_problem(Reader& from) {
  Problem p{};
  std::vector<char> moves;
  from >> p.constants >> p.geometry.shapes >> p.geometry.edges >> p.geometry.boxes >> p.geometry.faces >> p.region;
  from >> p.walls.x >> p.walls.y >> p.walls.z >> p.walls.container_begin >> moves;
  p.walls.container_moves.assign(moves.begin(), moves.end());
  from >> p.particles >> p.rank_boxes;
  return p;
}

std::vector<Share> shares_of(const Problem& p, const std::vector<Box>& boxes) {
  std::vector<Share> shares(boxes.size());
  for (std::size_t i = 0; 3 * i < p.position.size(); ++i) {
    const float *x = &p.position[3 * i], *v = &p.velocity[3 * i];
    const auto owner = std::ranges::find_if(boxes, [x](const Box& b) { return b.holds({x[0], x[1], x[2]}); });
    // What is nowhere is the first rank's.
    Share& s = shares[owner == boxes.end() ? 0 : static_cast<std::size_t>(owner - boxes.begin())];
    s.position.insert(s.position.end(), x, x + 3);
    s.velocity.insert(s.velocity.end(), v, v + 3);
    s.id.push_back(static_cast<int>(i));
  }
  return shares;
}

std::vector<Box> boxes_for(const Problem& p, int ranks) {
  const std::size_t n = p.position.size() / 3, step = std::max<std::size_t>(1, n / 65536);
  std::vector<WorkSample> samples;
  for (std::size_t i = 0; i < n; i += step)
    samples.push_back({{p.position[3 * i], p.position[3 * i + 1], p.position[3 * i + 2]}, 1.0f});
  return bisect(std::move(samples), ranks);
}

/// Rank 0 hands each rank its share; `rows` is how many each gets.
void scatter(Communicator& ranks, std::vector<Share>* shares, const std::vector<std::size_t>& rows, Problem& own) {
  const auto send_all = [&](auto Share::* member, auto& to, std::size_t width) {
    using T = typename std::remove_reference_t<decltype(to)>::value_type;
    std::vector<Segment> send(rows.size()), receive(rows.size());
    if (shares) {
      for (std::size_t r = 1; r < rows.size(); ++r)
        send[r] = {((*shares)[r].*member).data(), rows[r] * width * sizeof(T)};
      to = std::move((*shares)[0].*member);
    } else {
      to.resize(rows[static_cast<std::size_t>(ranks.rank())] * width);
      receive[0] = {to.data(), to.size() * sizeof(T)};
    }
    ranks.exchange(send, receive);
  };
  send_all(&Share::position, own.position, 3);
  send_all(&Share::velocity, own.velocity, 3);
  send_all(&Share::id, own.id, 1);
}

}  // namespace

void DeviceSolver::join(Communicator&) { throw BackendError("this backend does not run on ranks"); }

Bytes RankSide::perform(const Bytes& request, std::vector<Share>* shares) {
  Reader from(request);
  Writer answer;
  Request what{};
  int number = 0;
  from >> what >> number;
  if (what == Request::make) {
    SolverChoice choice;
    from >> choice;
    auto solver = make_(choice);
    solver->join(ranks_);
    solvers_[number] = std::move(solver);
    return {};
  }
  DeviceSolver& own = solver(number);
  std::vector<DevicePose> poses;
  switch (what) {
    case Request::drop:
      solvers_.erase(number);
      break;
    case Request::load: {
      std::vector<std::size_t> rows;
      Problem share = get_problem(from);
      from >> rows;
      scatter(ranks_, shares, rows, share);
      own.load(share);
      break;
    }
    case Request::evaluate:
    case Request::evaluate_density: {
      GivenInputs given;
      HostFields fields;
      from >> poses >> given.boundary_volume >> given.density >> given.pressure;
      answer << (what == Request::evaluate ? own.evaluate(poses, given, fields) : own.evaluate_density(poses, fields));
      const RankRows rows = own.rank_rows();
      answer << owned_ids(rows);
      if (ranks_.rank() == 0) answer << fields.boundary_volume;
      each_field(fields, [&](auto& values, std::size_t width) {
        answer << owned_rows(std::span<const typename std::remove_reference_t<decltype(values)>::value_type>(values),
                             width, rows);
      });
      break;
    }
    case Request::advance: {
      int substeps = 0;
      from >> substeps >> poses;
      answer << own.advance(substeps, poses);
      break;
    }
    case Request::read: {
      const RankRows rows = own.rank_rows();
      const StateRows state = own.read();
      answer << owned_ids(rows) << owned_rows(state.position, 3, rows) << owned_rows(state.velocity, 3, rows);
      break;
    }
    case Request::stats:
      answer << own.neighbor_stats();
      break;
    default:
      throw BackendError("rank " + std::to_string(ranks_.rank()) + ": unknown request");
  }
  return answer.take();
}

void RankSide::serve() noexcept {
  try {
    for (;;) {
      Bytes request;
      ranks_.broadcast(request);
      Request what{};
      Reader(request) >> what;
      if (what == Request::end) break;
      ranks_.gather(perform(request));
    }
  } catch (const std::exception& e) {
    ranks_.fail("rank " + std::to_string(ranks_.rank()) + ": " + e.what());
  }
  solvers_.clear();
}

RankTeam::RankTeam(std::unique_ptr<Communicator> ranks, const MakeSolver& make, std::vector<std::thread> others)
    : ranks_(std::move(ranks)), own_(*ranks_, make), others_(std::move(others)) {}

RankTeam::~RankTeam() {
  try {
    Bytes request = header(Request::end, 0).take();
    ranks_->broadcast(request);
  } catch (const std::exception&) {
    // They have ended already.
  }
  for (std::thread& t : others_) t.join();
}

std::vector<Bytes> RankTeam::ask(const Bytes& request, std::vector<Share>* shares) {
  const std::lock_guard lock(mutex_);
  try {
    Bytes sent = request;
    ranks_->broadcast(sent);
    return ranks_->gather(own_.perform(request, shares));
  } catch (const std::exception& e) {
    ranks_->fail(std::string("rank 0: ") + e.what());
    throw;
  }
}

namespace {

class RankedSolver : public DeviceSolver {
 public:
  RankedSolver(std::shared_ptr<RankTeam> team, const SolverChoice& choice)
      : team_(std::move(team)), number_(team_->next_number()) {
    Writer request = header(Request::make, number_);
    request << choice;
    team_->ask(request.take());
  }
  ~RankedSolver() override {
    try {
      team_->ask(header(Request::drop, number_).take());
    } catch (const std::exception&) {
      // Ranks that have failed have dropped everything.
    }
  }

  void load(const Problem& problem) override {
    const std::vector<Box> boxes = boxes_for(problem, team_->size());
    std::vector<Share> shares = shares_of(problem, boxes);
    std::vector<std::size_t> rows;
    for (const Share& s : shares) rows.push_back(s.id.size());
    Writer request = header(Request::load, number_);
    put_problem(request, problem, boxes);
    request << rows;
    team_->ask(request.take(), &shares);
    particles_ = problem.position.size() / 3;
    loaded_ = true;
  }
  Status evaluate(const std::vector<DevicePose>& poses, const GivenInputs& given, HostFields& out) override {
    return fields(Request::evaluate, poses, given, out);
  }
  Status evaluate_density(const std::vector<DevicePose>& poses, HostFields& out) override {
    return fields(Request::evaluate_density, poses, {}, out);
  }
  Status advance(int substeps, const std::vector<DevicePose>& poses) override {
    require_loaded();
    Writer request = header(Request::advance, number_);
    request << substeps << poses;
    Status status;
    Reader(team_->ask(request.take())[0]) >> status;
    return status;
  }
  StateRows read() override {
    require_loaded();
    // What no rank answers for stays unwritten.
    position_.assign(3 * particles_, std::numeric_limits<float>::quiet_NaN());
    velocity_ = position_;
    for (const Bytes& bytes : team_->ask(header(Request::read, number_).take())) {
      Reader from(bytes);
      std::vector<int> ids;
      from >> ids;
      for (std::vector<float>* to : {&position_, &velocity_}) place(from, ids, 3, *to);
    }
    return {position_, velocity_};
  }
  StageTimes stage_times() const override { return team_->own_solver(number_).stage_times(); }
  /// Sums over ranks, or the most of any where all do the same.
  NeighborStats neighbor_stats() const override {
    NeighborStats all;
    for (const Bytes& bytes : team_->ask(header(Request::stats, number_).take())) {
      NeighborStats own;
      Reader(bytes) >> own;
      all.rebuilds = std::max(all.rebuilds, own.rebuilds);
      all.device_bytes += own.device_bytes;
      all.verified.pairs += own.verified.pairs;
      all.verified.missed += own.verified.missed;
      all.verified.wall_pairs += own.verified.wall_pairs;
      all.verified.wall_missed += own.verified.wall_missed;
      all.ranks.ghosts += own.ranks.ghosts;
      all.ranks.migrations = std::max(all.ranks.migrations, own.ranks.migrations);
      all.ranks.rebalances = std::max(all.ranks.rebalances, own.ranks.rebalances);
      all.ranks.largest_imbalance = std::max(all.ranks.largest_imbalance, own.ranks.largest_imbalance);
    }
    return all;
  }

 private:
  void require_loaded() const {
    if (!loaded_) throw BackendError("nothing is loaded");
  }
  Status fields(Request what, const std::vector<DevicePose>& poses, const GivenInputs& given, HostFields& out) {
    require_loaded();
    Writer request = header(what, number_);
    request << poses << given.boundary_volume << given.density << given.pressure;
    Status status;
    bool first = true;
    for (const Bytes& bytes : team_->ask(request.take())) {
      Reader from(bytes);
      std::vector<int> ids;
      from >> status >> ids;
      if (first) from >> out.boundary_volume;
      each_field(out, [&](auto& values, std::size_t width) {
        using T = typename std::remove_reference_t<decltype(values)>::value_type;
        // Of densities alone the rest stays empty.
        const bool wanted = what == Request::evaluate || &values == static_cast<const void*>(&out.density) ||
                            &values == static_cast<const void*>(&out.pressure);
        if (first) values.assign(wanted ? width * particles_ : 0, unwritten<T>());
        place(from, ids, width, values);
      });
      first = false;
    }
    return status;
  }
  template <class T>
  static T unwritten() {
    if constexpr (std::is_floating_point_v<T>) return std::numeric_limits<T>::quiet_NaN();
    else return -1;
  }
  /// The next vector of an answer, row by row to where the ids say.
  template <class T>
  static void place(Reader& from, const std::vector<int>& ids, std::size_t width, std::vector<T>& to) {
    std::vector<T> values;
    from >> values;
    for (std::size_t k = 0; (k + 1) * width <= values.size(); ++k) {
      const auto at = static_cast<std::size_t>(ids[k]) * width;
      if (at + width <= to.size())
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(k * width), width,
                    to.begin() + static_cast<std::ptrdiff_t>(at));
    }
  }

  std::shared_ptr<RankTeam> team_;
  int number_;
  bool loaded_ = false;
  std::size_t particles_ = 0;
  std::vector<float> position_, velocity_;
};

}  // namespace

std::shared_ptr<RankTeam> make_thread_team(int ranks, const MakeSolver& make) {
  auto communicators = thread_communicators(ranks);
  const int cores = std::max(1, omp_get_max_threads() / ranks);
  std::vector<std::thread> others;
  for (int r = 1; r < ranks; ++r)
    others.emplace_back([own = std::move(communicators[static_cast<std::size_t>(r)]), make, cores] {
      omp_set_num_threads(cores);
#if DECANT_HAS_CUDA
      cuda::use_device(own->rank());
#endif
      RankSide(*own, make).serve();
    });
  return std::make_shared<RankTeam>(std::move(communicators[0]), make, std::move(others));
}

std::unique_ptr<DeviceSolver> make_on_ranks(std::shared_ptr<RankTeam> team, const SolverChoice& choice) {
  return std::make_unique<RankedSolver>(std::move(team), choice);
}

}  // namespace decant::gpu
