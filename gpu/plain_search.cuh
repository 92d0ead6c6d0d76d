/// \file
/// A search that builds nothing: a query over the arrays as they are is all of the backend. The shortest
/// way to a new one; BruteQuery and the test of an added backend show what a query offers beside what
/// passes.cuh asks of it:
///   Query<periodic>::of(c, a, all_end, segments)   from the arrays; all_end: where all padding ends
///   Query<periodic>::run(queue, n, pass)           starts a pass, with a team that each() can use
///   Query<periodic>::points_carry_square           whether positions carry |x|² as their fourth component
///                                                  instead of a wall particle's V_b
///   query.of_segment(team, container, x, points, visit)   visit(k, r2) for the wall particles of one
///                                                  container, in its frame, itself included
#pragma once

#include "gpu/pipeline.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

template <template <bool> class QueryOf>
class PlainSearch {
 public:
  explicit PlainSearch(const SolverOptions&) {}

  static constexpr bool points_carry_square = QueryOf<false>::points_carry_square;

  void load(Queue& queue, const Constants& c, const Arrays& a, const WallStore& walls,
            const Box&) {
    c_ = c;
    walls_ = walls;
    end_ = a.base + walls.padded_total();
    queue.for_each(walls.padded_total(), UnposedPass{a, walls_.walls});
    segments_.upload(walls.segments);
    for (std::size_t k = 0; k < walls.segments.size(); ++k)
      with_periodic(c_, [&](auto periodic) {
        using Query = QueryOf<decltype(periodic)::value>;
        const WallSegment& s = walls.segments[k];
        Query::run(queue, s.end - s.begin,
                   VolumePass<Query>{c_, a, query<Query>(a), walls_.walls, static_cast<int>(k),
                                     s.begin});
      });
  }
  void arrange(Arrays& a, const Particles& state, const Particles&) const {
    a.now = state;
    a.next = state;
  }
  void begin(Queue&, const Arrays&) {}
  bool capturable() const { return false; }
  template <bool periodic>
  bool advance(Queue&, const Arrays&, const DeviceGeometry&, int) {
    return false;
  }

  template <bool periodic, bool facts>
  void density(Queue& queue, const Arrays& a, const DeviceGeometry&, const FieldArrays& out,
               const Laps& laps) {
    using Query = QueryOf<periodic>;
    laps.build();
    Query::run(queue, a.n,
               DensityPass<Query, facts>{c_, a, query<Query>(a), out, walls_.walls.id});
    laps.density();
  }
  template <bool periodic, bool facts>
  void force(Queue& queue, const Arrays& a, const FieldArrays& out, const Laps& laps) {
    using Query = QueryOf<periodic>;
    Query::run(queue, a.n, ForcePass<Query, facts>{c_, a, query<Query>(a), out, {a}});
    laps.force();
  }
  template <bool periodic>
  void move(Queue& queue, const Arrays& a, const DeviceGeometry& geometry, const Laps& laps, bool) {
    queue.for_each(a.n + walls_.moving_count(),
                   IntegratePass<Nothing>{{c_, a, geometry, {}}, walls_.moving(a)});
    laps.integrate();
  }
  bool grow(int) { return false; }
  std::size_t bytes() const { return segments_.bytes(); }

 private:
  template <class Query>
  Query query(const Arrays& a) const {
    return Query::of(c_, a, end_, segments_.get());
  }

  Constants c_{};
  WallStore walls_{};
  Buffer<WallSegment> segments_;
  int end_ = 0;
};

}  // namespace decant::gpu::DECANT_EXECUTOR
