/// \file
/// A search that builds nothing: a neighbor range over the arrays as they are is all of the backend. The shortest
/// way to a new one; BruteNeighbors and the test of an added backend show what a range offers beside what
/// concepts.hpp asks of it:
///   Range<periodic>::Team             the threads that for_each() can use
///   Range<periodic>::stores_square    whether positions carry |x|² as their fourth component instead of the mass
///                                     or a wall particle's ρ0 V_b
///   Range<periodic>::of(c, a, all_end, segments)   from the arrays; all_end: where all padding ends
///   range.for_each_of_container(team, container, x, positions, visit)   visit(k, r2) for the wall particles of
///                                     one container, in its frame, itself included
#pragma once

#include "gpu/kernels/boundary_volume.cuh"
#include "gpu/kernels/integrate.cuh"
#include "gpu/solver/solver.cuh"

namespace decant::gpu {
namespace {

template <template <bool> class RangeOf>
class AllParticles {
 public:
  explicit AllParticles(const SolverOptions&) {}

  static constexpr bool stores_square = RangeOf<false>::stores_square, rebuilds_on_demand = false;
  static_assert(RangeOf<true>::stores_square == stores_square);

  void load(Stream& stream, const Constants& c, const ParticleArrays& a, const WallStore& walls, const Box&) {
    c_ = c;
    walls_ = walls;
    end_ = a.base + walls.padded_total();
    stream.launch(place_walls_in_body_frame_kernel, walls.padded_total(), PlaceWallsInBodyFrame{a, walls_.walls});
    segments_.upload(walls.segments);
    for (std::size_t k = 0; k < walls.segments.size(); ++k)
      with_periodic(c_, [&](auto periodic) {
        using Range = RangeOf<decltype(periodic)::value>;
        const WallSegment& s = walls.segments[k];
        stream.launch_teams<typename Range::Team>(
            boundary_volume_kernel<typename Range::Team, Range>, s.end - s.begin,
            BoundaryVolume<Range>{c_, a, range<Range>(a), walls_.walls, static_cast<int>(k), s.begin});
      });
  }
  void arrange(ParticleArrays& a) const { a.current = a.next = a.state; }
  void begin(Stream& stream, const ParticleArrays&, const Begin& begin) { launch_begin(stream, begin); }
  template <bool periodic>
  void find_neighbors(Stream&, const ParticleArrays&, const DeviceGeometry&, Branch) {}

  template <bool periodic, class Call>
  void with_neighbors(const ParticleArrays& a, Call call) const {
    using Range = RangeOf<periodic>;
    call(std::type_identity<typename Range::Team>(), range<Range>(a));
  }
  template <bool periodic, class Call>
  void with_diagnostic_neighbors(const ParticleArrays& a, Call call) const {
    with_neighbors<periodic>(a, call);
  }

  template <bool periodic>
  void integrate(Stream& stream, const ParticleArrays& a, const DeviceGeometry& geometry, Branch) {
    stream.launch(integrate_kernel<NothingElse>, a.n + walls_.moving_count(),
                  Integrate<NothingElse>{c_, a, geometry, {}}, walls_.moving(a));
  }
  void restore_state(Stream&, const ParticleArrays&) {}
  template <bool periodic>
  bool advance(Stream&, const ParticleArrays&, const DeviceGeometry&, int) {
    return false;
  }
  bool capturable() const { return false; }
  bool grow(const DeviceStatus&) { return false; }
  std::size_t bytes() const { return segments_.bytes(); }

 private:
  template <class Range>
  Range range(const ParticleArrays& a) const {
    return Range::of(c_, a, end_, segments_.get());
  }

  Constants c_{};
  WallStore walls_{};
  Buffer<WallSegment> segments_;
  int end_ = 0;
};

}  // namespace
}  // namespace decant::gpu
