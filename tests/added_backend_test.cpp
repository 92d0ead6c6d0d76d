/// \file
/// A backend of somebody else: what has to be written for one, and that it is judged like the others.
#include "gpu/plain_search.cuh"
#include "gpu/queries.cuh"

#include "gpu/backends.hpp"
#include "oracle/conform.hpp"

#include <gtest/gtest.h>

namespace decant::gpu::host {
namespace {

/// Looks at every particle, but measures only those that are near along x.
template <bool periodic>
struct SlabQuery : FullPoints {
  int base, all_end;
  const WallSegment* segments;

  static constexpr bool points_carry_square = false;
  static SlabQuery of(const Constants& c, const Arrays& a, int all_end, const WallSegment* segments) {
    return {{c}, a.base, all_end, segments};
  }
  template <class Pass>
  static void run(Queue& queue, int n, const Pass& pass) {
    queue.for_each_group<1>(n, pass);
  }

  template <class Team, class Visit>
  void each(Team& team, const Float3 (&x)[1], const float4* points, Visit&& visit) const {
    for (int j = 0; j < all_end; ++j) {
      const Float3 d = nearest_image<periodic>(c, x[0] - xyz(points[j]));
      // Padding is NaN and near nothing.
      if (j != team.particle(0) && fabsf(d.x) < c.H && dot(d, d) < c.H2)
        visit(0, j, points[j], d, dot(d, d));
    }
  }
  template <class Team, class Visit>
  void of_segment(Team&, int container, const Float3 (&x)[1], const float4* points,
                  Visit&& visit) const {
    for (int j = segments[container].begin; j < segments[container].end; ++j) {
      const Float3 d = nearest_image<periodic>(c, x[0] - xyz(points[base + j]));
      if (dot(d, d) < c.H2) visit(0, dot(d, d));
    }
  }
};

}  // namespace
}  // namespace decant::gpu::host

namespace decant {
namespace {

TEST(AddedBackend, IsJudgedLikeTheOthers) {
  using Solver = gpu::host::Pipeline<gpu::host::PlainSearch<gpu::host::SlabQuery>>;
  const auto backend = backend_around("slab", Executor::host, "",
                                      std::make_unique<Solver>(gpu::SolverOptions{}));
  EXPECT_EQ(backend->info().name, "slab");
  for (const char* name : {"hostile-crowd", "hostile-periodic", "hostile-cell-faces"}) {
    const Fixture fixture =
        read_fixture(std::string(DECANT_SOURCE_DIR "/fixtures/") + name + ".h5");
    int rows = 0;
    for (const CheckRow& row : judge(*backend, fixture, prepare(fixture))) {
      EXPECT_EQ(judged_verdict(row), Verdict::pass) << name << ": " << row.check << " " << row.field;
      ++rows;
    }
    EXPECT_GT(rows, 30) << name;
  }
}

}  // namespace
}  // namespace decant
