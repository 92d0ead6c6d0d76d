/// \file
/// The backend that gpu/ADD_A_BACKEND.md adds to the table, for both executors: a query over all
/// particles that measures only those that are near along x. ci/tutorials compares the document and
/// this file.
#pragma once

#include "gpu/plain_search.cuh"
#include "gpu/queries.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

template <bool periodic>
struct SlabQuery : FullPoints {
  int base, all_end;
  const WallSegment* segments;

  static constexpr bool points_carry_square = false;
  static SlabQuery of(const Constants& c, const Arrays& a, int all_end,
                      const WallSegment* segments) {
    return {{c}, a.base, all_end, segments};
  }
  template <class Pass>
  static void run(Queue& queue, int n, const Pass& pass) {
    queue.for_each_group<1>(n, pass);
  }

  template <class Team, class Visit>
  DECANT_DEVICE void each(Team& team, const Float3 (&x)[1], const float4* points,
                          Visit&& visit) const {
    for (int j = 0; j < all_end; ++j) {
      const Float3 d = nearest_image<periodic>(c, x[0] - xyz(points[j]));
      // Padding is NaN and near nothing.
      if (j != team.particle(0) && fabsf(d.x) < c.H && dot(d, d) < c.H2)
        visit(0, j, points[j], d, dot(d, d));
    }
  }

  template <class Team, class Visit>
  DECANT_DEVICE void of_segment(Team&, int container, const Float3 (&x)[1], const float4* points,
                                Visit&& visit) const {
    for (int j = segments[container].begin; j < segments[container].end; ++j) {
      const Float3 d = nearest_image<periodic>(c, x[0] - xyz(points[base + j]));
      if (dot(d, d) < c.H2) visit(0, dot(d, d));
    }
  }
};

using SlabSearch = PlainSearch<SlabQuery>;

}  // namespace decant::gpu::DECANT_EXECUTOR
