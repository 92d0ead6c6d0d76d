/// \file
/// A backend from a search: owns the device arrays and runs the stages in order, the whole substep on
/// the device. Substeps are recorded and replayed where the search allows; one small read-back an
/// `advance` tells of trouble.
///
/// A search that finds its lists too short says so in the mailbox. What was computed since is thrown
/// away: the state before is put back, the lists grow, and the same substeps run again.
#pragma once

#include "gpu/device_solver.hpp"
#include "gpu/field_desk.cuh"
#include "gpu/search.cuh"
#include "reference/error.hpp"

#include <algorithm>
#include <limits>

namespace decant::gpu::DECANT_EXECUTOR {

/// \tparam Search  BruteSearch shows what it must offer.
template <class Search>
class Pipeline : public DeviceSolver {
 public:
  explicit Pipeline(const SolverOptions& options) : search_(options) {}

  void load(const Problem& problem) override {
    loaded_ = false;  // should anything below fail
    long_recording_.clear();
    short_recording_.clear();
    c_ = problem.constants;
    containers_ = static_cast<int>(problem.geometry.shapes.size());
    n_ = static_cast<int>(problem.position.size() / 3);
    shapes_.upload(problem.geometry.shapes);
    edges_.upload(problem.geometry.edges);
    boxes_.upload(problem.geometry.boxes);
    faces_.upload(problem.geometry.faces);
    geometry_ = {containers_, shapes_.get(), edges_.get(), boxes_.get(), faces_.get(), {}, {}};
    const auto come_along = [](const auto& all, auto& first) {
      for (std::size_t k = 0; k < std::min(all.size(), std::size(first)); ++k) first[k] = all[k];
    };
    come_along(problem.geometry.shapes, geometry_.first_shapes);
    come_along(problem.geometry.edges, geometry_.first_edges);
    load_walls(problem.walls);
    allocate();
    state_.upload(problem.position, problem.velocity, c_.mass);
    place_ghost();
    times_ = {};
    rebuilds_ = advances_ = 0;
    totals_ = {};
    search_.load(queue_, c_, arrays(), wall_store_, problem.region);
    queue_.wait();
    in_use_ = false;
    loaded_ = true;
  }

  Status evaluate(const std::vector<DevicePose>& poses, const GivenInputs& given,
                  HostFields& out) override {
    require_loaded();
    upload_poses(poses);
    std::vector<float> own_volume = wall_volume_.download(static_cast<std::size_t>(m_));
    if (!given.boundary_volume.empty()) wall_volume_.upload(given.boundary_volume);
    Mailbox mail;
    for (;;) {
      if (in_use_ && given.boundary_volume.empty())
        carry_on();
      else
        begin();
      const FieldArrays fields = desk_.unwritten(n_);
      with_periodic(c_, [&](auto periodic) {
        constexpr bool p = decltype(periodic)::value;
        const Arrays a = arrays();
        search_.template density<p, true>(queue_, a, geometry(), fields, Laps());
        if (!given.density.empty()) use_given(a, given, fields.pressure);
        search_.template force<p, true>(queue_, a, fields, Laps());
      });
      queue_.wait();
      mail = mailbox_.download(1)[0];
      in_use_ = false;
      if (!grow(mail)) break;
    }
    desk_.download(out);
    desk_.clear();  // room that a run does not need
    wall_volume_.upload(own_volume);
    out.boundary_volume = std::move(own_volume);
    return status_of(mail);
  }

  Status advance(int substeps, const std::vector<DevicePose>& poses) override {
    require_loaded();
    in_use_ = false;
    upload_poses(poses);
    save();
    Mailbox mail;
    for (;;) {
      begin();
      run(substeps);
      queue_.wait();
      mail = mailbox_.download(1)[0];
      if (!grow(mail)) break;
      put_back();
    }
    in_use_ = true;
    watch_.read();
    rebuilds_ += mail.rebuilds;
    add_times(mail);
    totals_.pairs += mail.pairs;
    totals_.missed += mail.pairs_missed;
    totals_.wall_pairs += mail.wall_pairs;
    totals_.wall_missed += mail.wall_pairs_missed;
    return status_of(mail);
  }

  void read(std::vector<float>& position, std::vector<float>& velocity) const override {
    const auto n = static_cast<std::size_t>(n_);
    const std::vector<int> id = state_.id.download(n);
    position = by_id(state_.position.download(n), id);
    velocity = by_id(state_.velocity.download(n), id);
  }

  StageTimes stage_times() const override { return times_; }
  std::int64_t rebuilds() const override { return rebuilds_; }
  PairTotals pair_totals() const override { return totals_; }

  std::size_t device_bytes() const override {
    return state_.bytes() + spare_position_.bytes() + spare_velocity_.bytes() + point_.bytes() +
           motion_.bytes() + saved_.bytes() + wall_local_.bytes() + wall_id_.bytes() +
           wall_container_.bytes() + wall_volume_.bytes() + search_.bytes();
  }

 private:
  // Substeps of the long recording: launching it is then cheap beside running it.
  static constexpr int long_run = 16;

  struct State {
    Buffer<float4> position, velocity;
    Buffer<int> id;

    std::size_t bytes() const { return position.bytes() + velocity.bytes() + id.bytes(); }
    void upload(const std::vector<float>& x, const std::vector<float>& v, float mass) {
      upload_rows(position, x, [mass](float square) {
        return Search::points_carry_square ? square : mass;
      });
      upload_rows(velocity, v, [](float) { return 0.0f; });
      std::vector<int> ids(id.size());
      for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<int>(i);
      id.upload(ids);
    }
  };

  void require_loaded() const {
    if (!loaded_) throw BackendError("nothing is loaded");
  }

  void allocate() {
    const auto n = static_cast<std::size_t>(n_);
    const auto all = static_cast<std::size_t>(ghost()) + 1 + read_past;
    state_.position.resize(all);
    state_.velocity.resize(n);
    state_.id.resize(n);
    spare_position_.resize(all);
    spare_velocity_.resize(n);
    point_.resize(all);
    motion_.resize(all);
    saved_.resize(n * saved_bytes);
    mailbox_.resize(1);
  }
  int ghost() const { return padded(n_) + wall_store_.padded_total(); }
  /// Arrays that neighbors are read from get their ghost. Its squared distance is finite.
  void place_ghost() {
    const std::vector<float4> far{make_float4(1e12f, 1e12f, 1e12f, 0.0f)}, none{make_float4(0, 0, 0, 0)};
    const auto at = static_cast<std::size_t>(ghost());
    for (Buffer<float4>* points : {&state_.position, &spare_position_, &point_})
      points->upload_at(at, far);
    motion_.upload_at(at, none);
  }

  /// Padding is nowhere: no comparison with NaN holds, so it is nobody's neighbor.
  static constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();

  /// With a fourth component, of |row|².
  template <class Fourth>
  static void upload_rows(Buffer<float4>& to, const std::vector<float>& rows, Fourth fourth) {
    std::vector<float4> points(to.size(), make_float4(nowhere, nowhere, nowhere, 0.0f));
    for (std::size_t i = 0; 3 * i + 2 < rows.size(); ++i) {
      const float x = rows[3 * i], y = rows[3 * i + 1], z = rows[3 * i + 2];
      points[i] = make_float4(x, y, z, fourth(x * x + y * y + z * z));
    }
    to.upload(points);
  }

  static std::vector<float> by_id(const std::vector<float4>& points, const std::vector<int>& id) {
    std::vector<float> rows(3 * points.size(), nowhere);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto k = 3 * static_cast<std::size_t>(id[i]);
      if (k + 2 >= rows.size()) throw BackendError("an id out of range came back");
      rows[k] = points[i].x;
      rows[k + 1] = points[i].y;
      rows[k + 2] = points[i].z;
    }
    return rows;
  }

  void load_walls(const WallSamples& walls) {
    std::vector<float> rows;
    std::vector<int> ids, containers;
    wall_store_ = {};
    bool any_moves = false;
    for (std::size_t c = 0; c + 1 < walls.container_begin.size(); ++c) {
      WallSegment s{};
      s.begin = static_cast<int>(ids.size());
      float low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
      for (int b = walls.container_begin[c]; b < walls.container_begin[c + 1]; ++b) {
        const auto k = static_cast<std::size_t>(b);
        const float x[3] = {walls.x[k], walls.y[k], walls.z[k]};
        for (int a = 0; a < 3; ++a) {
          low[a] = b == walls.container_begin[c] ? x[a] : std::min(low[a], x[a]);
          high[a] = b == walls.container_begin[c] ? x[a] : std::max(high[a], x[a]);
        }
        rows.insert(rows.end(), {x[0], x[1], x[2]});
        ids.push_back(b);
      }
      s.end = static_cast<int>(ids.size());
      s.low = {low[0], low[1], low[2]};
      s.high = {high[0], high[1], high[2]};
      const auto whole = static_cast<std::size_t>(padded(s.end));
      rows.resize(3 * whole, nowhere);
      ids.resize(whole, -1);
      containers.resize(whole, static_cast<int>(c));
      if (walls.container_moves[c]) {
        if (!any_moves) wall_store_.first_moving = s.begin;
        any_moves = true;
        wall_store_.moving_end = s.end;
      }
      wall_store_.segments.push_back(s);
      wall_store_.moves.push_back(walls.container_moves[c]);
    }
    m_ = static_cast<int>(walls.x.size());
    wall_local_.resize(ids.size());
    upload_rows(wall_local_, rows, [](float) { return 0.0f; });
    wall_id_.upload(ids);
    wall_container_.upload(containers);
    wall_volume_.resize(static_cast<std::size_t>(m_));
    wall_store_.walls = {wall_local_.get(), wall_id_.get(), wall_container_.get(),
                         wall_volume_.get(), c_.rest_density};
  }

  void upload_poses(const std::vector<DevicePose>& poses) {
    if (poses.size() > poses_.size()) {
      long_recording_.clear();
      short_recording_.clear();
      poses_.resize(2 * poses.size());
    }
    poses_.upload(poses);
  }

  Arrays arrays() {
    Arrays a{};
    a.n = n_;
    a.base = padded(n_);
    a.ghost = ghost();
    a.id = state_.id.get();
    a.point = point_.get();
    a.motion = motion_.get();
    a.square = Search::points_carry_square;
    a.mailbox = mailbox_.get();
    a.poses = poses_.get();
    a.containers = containers_;
    a.acceleration = spare_position_.get();
    search_.arrange(a, {state_.position.get(), state_.velocity.get()},
                    {spare_position_.get(), spare_velocity_.get()});
    return a;
  }

  const DeviceGeometry& geometry() const { return geometry_; }

  /// No substep yet, nothing found, walls in place, and neighbors to be looked for.
  void begin() {
    Mailbox mail{};
    mail.non_finite = mail.escaped = mail.missed = ~0ull;
    mail.stale = 1;
    mailbox_.upload({mail});
    const Arrays a = arrays();
    queue_.for_each(wall_store_.padded_total(), PosePass{a, wall_store_.walls, 0});
    search_.begin(queue_, a);
  }

  /// What the last advance left, lists, counts, and walls where they stand, for fields of what its next
  /// substep would use: only what that one would do first is done.
  void carry_on() {
    Mailbox mail = mailbox_.download(1)[0];
    mail.non_finite = mail.escaped = mail.missed = ~0ull;
    mail.begun = mail.ended = 0;
    mailbox_.upload({mail});
    if (walls_half_placed_)
      queue_.for_each(wall_store_.moving_count(), wall_store_.moving<PlacedFor::force>(arrays()));
  }

  /// At once where the search can. Else now and then the first substep is timed stage by stage and so is
  /// the second, which shares a list with the first; the others are replayed. So is the first advance
  /// after a load: what is compared with the oracle is what runs.
  void run(int substeps) {
    bool done_at_once = false;
    with_periodic(c_, [&](auto periodic) {
      done_at_once = search_.template advance<decltype(periodic)::value>(queue_, arrays(), geometry(),
                                                                         substeps);
    });
    walls_half_placed_ = done_at_once;
    if (done_at_once) return;
    int done = 0;
    const int sample = advances_++ % 8 == 1 ? 2 : 0;
    const int timed = search_.capturable() ? std::min(substeps, sample) : substeps;
    for (; done < timed; ++done) {
      substep(Laps(queue_, watch_, times_));
      // Events are many; reading them now and then keeps their number small.
      if (done % 64 == 63) watch_.read();
    }
    if (substeps - done >= long_run && !long_recording_.recorded())
      long_recording_.record(queue_, [this] {
        for (int k = 0; k < long_run; ++k) substep(Laps(), k + 1 < long_run);
      });
    for (; substeps - done >= long_run; done += long_run) long_recording_.replay(queue_);
    if (substeps > done && !short_recording_.recorded())
      short_recording_.record(queue_, [this] { substep(Laps()); });
    for (; done < substeps; ++done) short_recording_.replay(queue_);
  }

  /// Of substeps that kept their own time.
  void add_times(const Mailbox& mail) {
    const auto add = [&](StageTimes::Stage& stage, int k, int calls) {
      if (mail.stage_ns[k] <= 0) return;
      stage.seconds += 1e-9 * static_cast<double>(mail.stage_ns[k]);
      stage.calls += calls;
    };
    const int substeps = static_cast<int>(mail.ended);
    add(times_.build, 0, mail.rebuilds);
    add(times_.density, 1, substeps);
    add(times_.force, 2, substeps);
  }

  /// Whether lists were too short and have grown. Recordings know where the lists were.
  bool grow(const Mailbox& mail) {
    if (mail.longest_list == 0 || !search_.grow(mail.longest_list)) return false;
    long_recording_.clear();
    short_recording_.clear();
    return true;
  }

  /// \param more  another one follows in the same recording
  void substep(const Laps& laps, bool more = false) {
    with_periodic(c_, [&](auto periodic) {
      constexpr bool p = decltype(periodic)::value;
      const Arrays a = arrays();
      search_.template density<p, false>(queue_, a, geometry(), FieldArrays{}, laps);
      search_.template force<p, false>(queue_, a, FieldArrays{}, laps);
      search_.template move<p>(queue_, a, geometry(), laps, more);
    });
  }

  static constexpr std::size_t saved_bytes = 2 * 16 + 4;

  /// each(part of the state, its place in saved_, bytes)
  template <class Each>
  void each_saved(Each each) {
    std::size_t at = 0;
    const auto n = static_cast<std::size_t>(n_);
    each(state_.position.get(), cut<float4>(saved_, at, n), n * sizeof(float4));
    each(state_.velocity.get(), cut<float4>(saved_, at, n), n * sizeof(float4));
    each(state_.id.get(), cut<int>(saved_, at, n), n * sizeof(int));
  }
  void save() {
    each_saved([&](void* from, void* to, std::size_t bytes) { queue_.copy(to, from, bytes); });
  }
  void put_back() {
    each_saved([&](void* to, void* from, std::size_t bytes) { queue_.copy(to, from, bytes); });
  }

  void use_given(const Arrays& a, const GivenInputs& given, float* own_pressure) {
    Buffer<float> density(static_cast<std::size_t>(n_)), pressure(static_cast<std::size_t>(n_));
    density.upload(given.density);
    const bool pressure_too = !given.pressure.empty();
    if (pressure_too) pressure.upload(given.pressure);
    queue_.for_each(n_, GivenPass{c_, a, density.get(), pressure_too ? pressure.get() : nullptr,
                                  own_pressure});
    queue_.wait();  // the two buffers end here
  }

  static Status status_of(const Mailbox& mail) {
    Status status;
    const unsigned long long first = std::min({mail.non_finite, mail.escaped, mail.missed});
    if (mail.non_finite != ~0ull) status.bits |= Status::non_finite;
    if (mail.escaped != ~0ull) status.bits |= Status::escaped;
    if (mail.missed != ~0ull) status.bits |= Status::missed_pair;
    // Nobody grew what was too short: whatever came out of it is not to be used.
    if (mail.longest_list != 0) status.bits |= Status::capacity;
    if (first != ~0ull) {
      status.particle = static_cast<std::int64_t>(first & 0xFFFFFFFFull);
      status.substep = static_cast<std::int64_t>(first >> 32);
    }
    return status;
  }

  Queue queue_;
  Search search_;
  Constants c_{};
  int containers_ = 0, n_ = 0, m_ = 0;
  bool loaded_ = false;
  bool in_use_ = false;  // what an advance left is as it left it
  bool walls_half_placed_ = false;  // for densities, not yet for forces
  Buffer<Shape> shapes_;
  Buffer<Edge> edges_;
  Buffer<Box> boxes_;
  Buffer<Face> faces_;
  DeviceGeometry geometry_{};
  Buffer<DevicePose> poses_;
  State state_;
  Buffer<float4> spare_position_, spare_velocity_, point_, motion_;
  Buffer<char> saved_;  // the state before an advance
  FieldDesk desk_;
  Buffer<Mailbox> mailbox_;
  WallStore wall_store_{};
  Buffer<float4> wall_local_;
  Buffer<int> wall_id_, wall_container_;
  Buffer<float> wall_volume_;
  std::int64_t rebuilds_ = 0, advances_ = 0;
  PairTotals totals_;
  StageTimes times_;
  Stopwatch watch_;
  Recording long_recording_, short_recording_;
};

}  // namespace decant::gpu::DECANT_EXECUTOR
