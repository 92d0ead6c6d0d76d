/// \file
/// The backend that gpu/ADD_A_BACKEND.md adds to the table, for both executors: a neighbor range over all
/// particles that measures only those that are near along x. ci/tutorials compares the document and
/// this file.
#include "gpu/backends/all_particles.cuh"
#include "gpu/kernels/neighbor_ranges.cuh"

namespace decant::gpu {
namespace {

template <bool periodic>
struct SlabNeighbors : WeightsInPositions {
  int base, all_end;
  const WallSegment* segments;

  using Team = SubWarp<1>;
  static constexpr bool stores_square = false;
  static SlabNeighbors of(const Constants& c, const ParticleArrays& a, int all_end, const WallSegment* segments) {
    return {{c}, a.base, all_end, segments};
  }

  template <class Visit>
  DECANT_DEVICE void for_each(Team& team, const Float3 (&x)[1], const float4* positions, Visit&& visit) const {
    for (int j = 0; j < all_end; ++j) {
      const Float3 d = nearest_image<periodic>(c, x[0] - xyz(positions[j]));
      // Padding is NaN and near nothing.
      if (j != team.particle(0) && fabsf(d.x) < c.H && dot(d, d) < c.H2) visit(0, j, positions[j], d, dot(d, d));
    }
  }

  template <class Visit>
  DECANT_DEVICE void for_each_of_container(Team&, int container, const Float3 (&x)[1], const float4* positions,
                                           Visit&& visit) const {
    for (int j = segments[container].begin; j < segments[container].end; ++j) {
      const Float3 d = nearest_image<periodic>(c, x[0] - xyz(positions[base + j]));
      if (dot(d, d) < c.H2) visit(0, dot(d, d));
    }
  }
};

}  // namespace

std::unique_ptr<DeviceSolver> DECANT_EXECUTOR::make_slab(const SolverOptions& options) {
  return std::make_unique<Solver<AllParticles<SlabNeighbors>>>(options);
}

}  // namespace decant::gpu
