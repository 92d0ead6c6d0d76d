/// \file
/// A backend from a neighbor query: owns the device arrays and runs the stages in order, the whole
/// substep on the device. One small read-back an `advance` tells of trouble.
#pragma once

#include "gpu/device_solver.hpp"
#include "gpu/passes.cuh"
#include "reference/error.hpp"

#include <algorithm>
#include <limits>

namespace decant::gpu::DECANT_EXECUTOR {

/// \tparam Search  names its Query for free and periodic scenes, and makes one from the arrays:
///   template <bool periodic> using Query; template <bool periodic> Query<periodic> query(c, arrays)
template <class Search>
class Pipeline : public DeviceSolver {
 public:
  void load(const Problem& problem) override {
    c_ = problem.constants;
    containers_ = static_cast<int>(problem.geometry.shapes.size());
    n_ = static_cast<int>(problem.position.size() / 3);
    m_ = static_cast<int>(problem.walls.x.size());
    shapes_.upload(problem.geometry.shapes);
    edges_.upload(problem.geometry.edges);
    boxes_.upload(problem.geometry.boxes);
    faces_.upload(problem.geometry.faces);
    allocate();
    upload_rows(position_, problem.position, n_);
    upload_rows(velocity_, problem.velocity, n_);
    upload_walls(problem.walls);
    times_ = {};
    posed_still_ = false;
    c_.any_periodic ? find_volumes<true>() : find_volumes<false>();
  }

  Status evaluate(const std::vector<DevicePose>& poses, const GivenInputs& given,
                  HostFields& out) override {
    require_loaded();
    poses_.upload(poses);
    clear_trouble();
    reset_fields();
    const std::vector<float> own_volume = wall_volume_.download(static_cast<std::size_t>(m_));
    if (!given.boundary_volume.empty()) wall_volume_.upload(given.boundary_volume);
    c_.any_periodic ? fields<true>(0, poses_.get(), &given) : fields<false>(0, poses_.get(), &given);
    download_fields(out);
    out.boundary_volume = own_volume;
    wall_volume_.upload(own_volume);
    watch_.read();
    return status();
  }

  Status advance(int substeps, const std::vector<DevicePose>& poses) override {
    require_loaded();
    poses_.upload(poses);
    clear_trouble();
    for (int k = 0; k < substeps; ++k) {
      const DevicePose* now = poses_.get() + static_cast<std::ptrdiff_t>(k) * containers_;
      const auto substep = static_cast<unsigned>(k + 1);
      c_.any_periodic ? fields<true>(substep, now, nullptr) : fields<false>(substep, now, nullptr);
      for_each(n_, IntegratePass{c_, arrays(), geometry(), now + containers_, substep});
      watch_.lap(times_.integrate);
      // Events are many; reading them now and then keeps their number small.
      if (k % 64 == 63) watch_.read();
    }
    const Status result = status();
    watch_.read();
    return result;
  }

  void read(std::vector<float>& position, std::vector<float>& velocity) const override {
    position = download_rows(position_, n_);
    velocity = download_rows(velocity_, n_);
  }

  StageTimes stage_times() const override { return times_; }

 private:
  void require_loaded() const {
    if (n_ < 0) throw BackendError("nothing is loaded");
  }

  void allocate() {
    const auto n = static_cast<std::size_t>(n_), m = static_cast<std::size_t>(m_);
    position_.resize(static_cast<std::size_t>(padded(n_)));
    velocity_.resize(n);
    thermo_.resize(n);
    reset_fields();
    wall_local_.resize(static_cast<std::size_t>(padded(m_)));
    wall_.resize(static_cast<std::size_t>(padded(m_)));
    wall_velocity_.resize(m);
    wall_volume_.resize(m);
    wall_container_.resize(m);
    trouble_.resize(2);
  }

  /// What no pass writes after this reads as NaN or −1.
  void reset_fields() {
    const auto n = static_cast<std::size_t>(n_);
    density_.resize(n);
    pressure_.resize(n);
    for (auto* b : {&pressure_acceleration_, &viscous_acceleration_, &wall_pressure_acceleration_,
                    &wall_viscous_acceleration_, &acceleration_})
      b->resize(n);
    for (auto* b : {&fluid_count_, &fluid_id_sum_, &wall_count_, &wall_id_sum_}) b->resize(n);
  }

  /// Padding is nowhere: no comparison with NaN holds, so it is nobody's neighbor.
  static constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();

  static void upload_rows(Buffer<float4>& to, const std::vector<float>& rows, int count) {
    std::vector<float4> points(to.size(), make_float4(nowhere, nowhere, nowhere, 0.0f));
    for (int i = 0; i < count; ++i) {
      const auto k = 3 * static_cast<std::size_t>(i);
      const float x = rows[k], y = rows[k + 1], z = rows[k + 2];
      points[static_cast<std::size_t>(i)] = make_float4(x, y, z, x * x + y * y + z * z);
    }
    to.upload(points);
  }

  static std::vector<float> download_rows(const Buffer<float4>& from, int count) {
    const auto points = from.download(static_cast<std::size_t>(count));
    std::vector<float> rows;
    rows.reserve(3 * points.size());
    for (const float4& p : points) rows.insert(rows.end(), {p.x, p.y, p.z});
    return rows;
  }

  void upload_walls(const WallSamples& walls) {
    std::vector<float> rows;
    std::vector<int> container;
    first_moving_ = m_;
    moving_end_ = m_;
    for (std::size_t c = 0; c + 1 < walls.container_begin.size(); ++c) {
      if (walls.container_moves[c]) first_moving_ = std::min(first_moving_, walls.container_begin[c]);
      for (int b = walls.container_begin[c]; b < walls.container_begin[c + 1]; ++b) {
        const auto k = static_cast<std::size_t>(b);
        rows.insert(rows.end(), {walls.x[k], walls.y[k], walls.z[k]});
        container.push_back(static_cast<int>(c));
      }
      if (walls.container_moves[c]) moving_end_ = walls.container_begin[c + 1];
    }
    upload_rows(wall_local_, rows, m_);
    upload_rows(wall_, rows, m_);
    wall_container_.upload(container);
  }

  Arrays arrays() const {
    return {n_, m_, position_.get(), velocity_.get(), density_.get(), pressure_.get(),
            thermo_.get(), pressure_acceleration_.get(), viscous_acceleration_.get(),
            wall_pressure_acceleration_.get(), wall_viscous_acceleration_.get(),
            acceleration_.get(), fluid_count_.get(), fluid_id_sum_.get(), wall_count_.get(),
            wall_id_sum_.get(), wall_local_.get(), wall_.get(), wall_velocity_.get(),
            wall_volume_.get(), wall_container_.get(), trouble_.get()};
  }

  DeviceGeometry geometry() const {
    return {containers_, shapes_.get(), edges_.get(), boxes_.get(), faces_.get()};
  }

  template <bool periodic>
  void find_volumes() {
    using Query = typename Search::template Query<periodic>;
    const Query query = search_.template query<periodic>(c_, arrays());
    for_each_team(m_, VolumePass<Query>{c_, arrays(), query});
  }

  /// Walls, density, pressure and accelerations at one time. Containers at rest are posed once.
  template <bool periodic>
  void fields(unsigned substep, const DevicePose* poses, const GivenInputs* given) {
    using Query = typename Search::template Query<periodic>;
    watch_.start();
    if (!posed_still_)
      for_each(m_, PosePass{arrays(), poses, 0});
    else
      for_each(moving_end_ - first_moving_, PosePass{arrays(), poses, first_moving_});
    posed_still_ = true;
    const Query query = search_.template query<periodic>(c_, arrays());
    watch_.lap(times_.build);
    for_each_team(n_, DensityPass<Query>{c_, arrays(), query});
    watch_.lap(times_.density);
    if (given && !(given->density.empty() && given->pressure.empty())) use_given(*given);
    for_each_team(n_, ForcePass<Query>{c_, arrays(), query, substep});
    watch_.lap(times_.force);
  }

  void use_given(const GivenInputs& given) {
    Buffer<float> density(static_cast<std::size_t>(n_)), pressure(static_cast<std::size_t>(n_));
    density.upload(given.density.empty() ? density_.download(static_cast<std::size_t>(n_))
                                         : given.density);
    pressure.upload(given.pressure.empty() ? pressure_.download(static_cast<std::size_t>(n_))
                                           : given.pressure);
    for_each(n_, ThermoPass{arrays(), density.get(), pressure.get()});
    thermo_.download(1);  // waits: the two buffers end here
  }

  void download_fields(HostFields& out) const {
    const auto n = static_cast<std::size_t>(n_);
    out.density = density_.download(n);
    out.pressure = pressure_.download(n);
    out.pressure_acceleration = download_rows(pressure_acceleration_, n_);
    out.viscous_acceleration = download_rows(viscous_acceleration_, n_);
    out.wall_pressure_acceleration = download_rows(wall_pressure_acceleration_, n_);
    out.wall_viscous_acceleration = download_rows(wall_viscous_acceleration_, n_);
    out.acceleration = download_rows(acceleration_, n_);
    const auto ids = [n](const Buffer<long long>& from) {
      const auto values = from.download(n);
      return std::vector<std::int64_t>(values.begin(), values.end());
    };
    out.fluid_count = ids(fluid_count_);
    out.fluid_id_sum = ids(fluid_id_sum_);
    out.wall_count = ids(wall_count_);
    out.wall_id_sum = ids(wall_id_sum_);
  }

  void clear_trouble() { trouble_.upload({~0ull, ~0ull}); }

  Status status() const {
    Status status;
    unsigned long long first = ~0ull;
    const auto words = trouble_.download(2);
    const std::uint32_t bits[] = {Status::non_finite, Status::escaped};
    for (int k = 0; k < 2; ++k) {
      if (words[static_cast<std::size_t>(k)] == ~0ull) continue;
      status.bits |= bits[k];
      first = std::min(first, words[static_cast<std::size_t>(k)]);
    }
    if (!status.ok()) {
      status.particle = static_cast<std::int64_t>(first & 0xFFFFFFFFull);
      status.substep = static_cast<std::int64_t>(first >> 32);
    }
    return status;
  }

  Search search_;
  Constants c_{};
  int containers_ = 0, n_ = -1, m_ = 0;
  int first_moving_ = 0, moving_end_ = 0;  // wall particles between them may move
  bool posed_still_ = false;
  Buffer<Shape> shapes_;
  Buffer<Edge> edges_;
  Buffer<Box> boxes_;
  Buffer<Face> faces_;
  Buffer<DevicePose> poses_;
  Buffer<float4> position_, velocity_;
  Buffer<float> density_, pressure_;
  Buffer<float2> thermo_;
  Buffer<float4> pressure_acceleration_, viscous_acceleration_, wall_pressure_acceleration_,
      wall_viscous_acceleration_, acceleration_;
  Buffer<long long> fluid_count_, fluid_id_sum_, wall_count_, wall_id_sum_;
  Buffer<float4> wall_local_, wall_, wall_velocity_;
  Buffer<float> wall_volume_;
  Buffer<int> wall_container_;
  Buffer<unsigned long long> trouble_;
  StageTimes times_;
  Stopwatch watch_;
};

}  // namespace decant::gpu::DECANT_EXECUTOR
