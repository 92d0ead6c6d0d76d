/// \file
/// The device memory of one loaded scene: constants, geometry, poses, fluid state, walls, device status.
#pragma once

#include "gpu/kernels/begin.cuh"
#include "gpu/solver/context.cuh"
#include "gpu/solver/device_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace decant::gpu {
namespace {

class SceneArrays {
 public:
  explicit SceneArrays(bool stores_square) : stores_square_(stores_square) {}

  void load(Stream& stream, const Problem& problem) {
    c_ = problem.constants;
    containers_ = static_cast<int>(problem.geometry.shapes.size());
    n_ = room_ = static_cast<int>(problem.position.size() / 3);
    total_ = n_;
    if (!problem.rank_boxes.empty()) {
      total_ = problem.particles;
      // Ghosts are to come: some layers around what is about a cube.
      const double layers = 8 * std::cbrt(static_cast<double>(n_) * n_);
      room_ = std::min(total_, n_ + static_cast<int>(layers) + n_ / 50) + tile_size;
    }
    // The same walls in another state or another time: tests and parameter studies load one scene again and again.
    if (loaded_geometry_ != problem.geometry) load_geometry(stream, problem.geometry);
    if (loaded_walls_ != problem.walls) load_walls(stream, problem.walls);
    walls_.walls.rest_density = c_.rest_density;
    allocate(stream, 0);
    upload_rows(stream, state_.position, problem.position,
                [this](float square) { return stores_square_ ? square : c_.mass; });
    upload_rows(stream, state_.velocity, problem.velocity, [](float) { return 0.0f; });
    std::vector<int> ids(id_.size());
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<int>(i);
    stream.upload(id_, ids);
    place_sentinel(stream);
  }

  const Constants& constants() const { return c_; }
  const DeviceGeometry& geometry() const { return geometry_; }
  const WallStore& walls() const { return walls_; }
  int particles() const { return n_; }
  /// Of a rank, whose number changes; as many as there is room for.
  void set_particles(int n) { n_ = n; }
  int room() const { return room_; }
  /// More room; the state is still there, walls are to be placed again.
  void grow(Stream& stream, int room) {
    room_ = room;
    stream.run_transfers();
    allocate(stream, static_cast<std::size_t>(n_));
    place_sentinel(stream);
  }
  /// Room for 32 bytes per particle, between advances.
  void* scratch() const { return saved_.get(); }
  /// All but which of them hold the state at a substep's start and end.
  ParticleArrays arrays() {
    ParticleArrays a{};
    a.n = n_;
    a.room = room_;
    a.total = total_;
    a.base = padded(room_);
    a.sentinel = sentinel();
    a.state = {state_.position.get(), state_.velocity.get()};
    a.spare = {spare_.position.get(), spare_.velocity.get()};
    a.id = id_.get();
    a.force_position = force_position_.get();
    a.force_velocity = force_velocity_.get();
    a.acceleration = spare_.position.get();
    a.stores_square = stores_square_;
    a.status = status_.get();
    a.poses = poses_.get();
    a.containers = containers_;
    return a;
  }

  /// Whether they lie elsewhere than before.
  bool upload_poses(const std::vector<DevicePose>& poses) {
    const bool grows = poses.size() > poses_.size();
    if (grows) poses_.resize(2 * poses.size());
    poses_.upload(poses);
    return grows;
  }
  DeviceStatus status() { return *status_read_.download(status_.get(), 1); }
  void set_status(const DeviceStatus& status) { status_.upload({status}); }
  std::vector<float> boundary_volumes() const { return wall_volume_.download(static_cast<std::size_t>(m_)); }
  void set_boundary_volumes(const std::vector<float>& volume) { wall_volume_.upload(volume); }
  /// The next load finds other walls than there are.
  void forget_walls() { loaded_walls_.reset(); }

  /// What an advance or evaluation begins with.
  Begin begin(const ParticleArrays& a, bool keeps_state) const {
    return {a,
            {a, walls_.walls, 0},
            walls_.padded_total(),
            keeps_state,
            {{state_.position.get(), state_.velocity.get()}, id_.get(), saved(), saved_ids()},
            blocks_ended_.get()};
  }
  void restore_state(Stream& stream) {
    stream.launch(copy_state_kernel, n_,
                  CopyState{saved(), saved_ids(), {state_.position.get(), state_.velocity.get()}, id_.get()});
  }
  /// By id; what nobody has written is NaN. The spare arrays hold nothing between advances.
  StateRows read(Stream& stream) {
    const std::size_t rows = 3 * static_cast<std::size_t>(n_);
    float *position = reinterpret_cast<float*>(spare_.position.get()),
          *velocity = reinterpret_cast<float*>(spare_.velocity.get());
    stream.fill_ones(position, rows * sizeof(float));
    stream.fill_ones(velocity, rows * sizeof(float));
    stream.launch(store_state_kernel, n_,
                  StoreState{n_, {state_.position.get(), state_.velocity.get()}, id_.get(), position, velocity});
    return {{positions_.download(position, rows), rows}, {velocities_.download(velocity, rows), rows}};
  }

  std::size_t bytes() const {
    return state_.bytes() + spare_.bytes() + id_.bytes() + force_position_.bytes() + force_velocity_.bytes() +
           saved_.bytes() + wall_local_.bytes() + wall_id_.bytes() + wall_container_.bytes() + wall_volume_.bytes();
  }

 private:
  struct ParticleBuffers {
    Buffer<float4> position, velocity;
    std::size_t bytes() const { return position.bytes() + velocity.bytes(); }
  };

  /// Padding is nowhere: no comparison with NaN holds, so it is nobody's neighbor.
  static constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();
  static constexpr std::size_t saved_bytes = 2 * 16 + 4;  // per particle

  void load_geometry(Stream& stream, const Geometry& geometry) {
    loaded_geometry_.reset();  // should anything below fail
    stream.upload(shapes_, geometry.shapes);
    stream.upload(edges_, geometry.edges);
    stream.upload(boxes_, geometry.boxes);
    stream.upload(faces_, geometry.faces);
    geometry_ = {containers_, shapes_.get(), edges_.get(), boxes_.get(), faces_.get(), {}, {}};
    const auto copy_first = [](const auto& all, auto& first) {
      for (std::size_t k = 0; k < std::min(all.size(), std::size(first)); ++k) first[k] = all[k];
    };
    copy_first(geometry.shapes, geometry_.first_shapes);
    copy_first(geometry.edges, geometry_.first_edges);
    loaded_geometry_ = geometry;
  }

  void load_walls(Stream& stream, const WallSamples& walls) {
    std::vector<float> rows;
    std::vector<int> ids, containers;
    const std::uint64_t version = walls_.version + 1;
    loaded_walls_.reset();  // should anything below fail
    walls_ = {};
    bool any_moves = false;
    for (std::size_t c = 0; c + 1 < walls.container_begin.size(); ++c) {
      WallSegment s{};
      s.begin = static_cast<int>(ids.size());
      s.first_id = walls.container_begin[c];
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
        if (!any_moves) walls_.first_moving = s.begin;
        any_moves = true;
        walls_.moving_end = s.end;
      }
      walls_.segments.push_back(s);
      walls_.moves.push_back(walls.container_moves[c]);
    }
    m_ = static_cast<int>(walls.x.size());
    stream.resize(wall_local_, ids.size());
    upload_rows(stream, wall_local_, rows, [](float) { return 0.0f; });
    stream.upload(wall_id_, ids);
    stream.upload(wall_container_, containers);
    stream.resize(wall_volume_, static_cast<std::size_t>(m_));
    walls_.walls = {wall_local_.get(), wall_id_.get(), wall_container_.get(), wall_volume_.get(), c_.rest_density};
    walls_.version = version;
    loaded_walls_ = walls;
  }

  /// For as many particles as there is room for; the state of the first `kept` is still there.
  void allocate(Stream& stream, std::size_t kept) {
    const auto keep = [&](auto& buffer, std::size_t size) {
      if (kept > 0) buffer.grow(size, kept);
      else stream.resize(buffer, size);
    };
    const auto n = static_cast<std::size_t>(room_);
    const auto all = static_cast<std::size_t>(sentinel()) + 1 + read_past_end;
    keep(state_.position, all);
    keep(state_.velocity, n);
    keep(id_, n);
    stream.resize(spare_.position, all);
    stream.resize(spare_.velocity, n);
    stream.resize(force_position_, all);
    stream.resize(force_velocity_, all);
    stream.resize(saved_, n * saved_bytes);
    stream.resize(status_, 1);
    stream.upload(blocks_ended_, {0});
  }
  int sentinel() const { return padded(room_) + walls_.padded_total(); }
  /// In the arrays that neighbors are read from. Its squared distance is finite.
  void place_sentinel(Stream& stream) {
    const std::vector<float4> far{make_float4(1e12f, 1e12f, 1e12f, 0.0f)}, none{make_float4(0, 0, 0, 0)};
    const auto at = static_cast<std::size_t>(sentinel());
    for (Buffer<float4>* positions : {&state_.position, &spare_.position, &force_position_})
      stream.upload_at(*positions, at, far);
    stream.upload_at(force_velocity_, at, none);
  }

  /// With a fourth component, of |row|².
  template <class Fourth>
  static void upload_rows(Stream& stream, Buffer<float4>& to, const std::vector<float>& rows, Fourth fourth) {
    std::vector<float4> points(to.size(), make_float4(nowhere, nowhere, nowhere, 0.0f));
    for (std::size_t i = 0; 3 * i + 2 < rows.size(); ++i) {
      const float x = rows[3 * i], y = rows[3 * i + 1], z = rows[3 * i + 2];
      points[i] = make_float4(x, y, z, fourth(x * x + y * y + z * z));
    }
    stream.upload(to, points);
  }

  Particles saved() const {
    std::size_t at = 0;
    const auto room = static_cast<std::size_t>(room_);
    float4* position = carve<float4>(saved_, at, room);
    return {position, carve<float4>(saved_, at, room)};
  }
  int* saved_ids() const {
    std::size_t at = 2 * sizeof(float4) * static_cast<std::size_t>(room_);
    return carve<int>(saved_, at, static_cast<std::size_t>(room_));
  }

  bool stores_square_;
  Constants c_{};
  int containers_ = 0, n_ = 0, m_ = 0;
  int room_ = 0, total_ = 0;  // fluid particles there may be here, and those of all ranks
  Buffer<Shape> shapes_;
  Buffer<Edge> edges_;
  Buffer<Box> boxes_;
  Buffer<Face> faces_;
  DeviceGeometry geometry_{};
  std::optional<Geometry> loaded_geometry_;  // what is on the device; none: nothing to rely on
  std::optional<WallSamples> loaded_walls_;
  Buffer<DevicePose> poses_;
  ParticleBuffers state_, spare_;
  Buffer<int> id_;
  Buffer<float4> force_position_, force_velocity_;
  Buffer<char> saved_;  // the state before an advance
  PinnedBuffer positions_, velocities_;
  Buffer<DeviceStatus> status_;
  PinnedBuffer status_read_;
  Buffer<int> blocks_ended_;
  WallStore walls_{};
  Buffer<float4> wall_local_;
  Buffer<int> wall_id_, wall_container_;
  Buffer<float> wall_volume_;
};

}  // namespace
}  // namespace decant::gpu
