/// \file
/// Both searches give the neighbors that the definition gives, in the same order, for clouds of
/// every kind, hostile ones included.
#include "reference/neighbors.hpp"
#include "tests/generators.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace decant::test {
namespace {

using Lists = std::vector<std::vector<std::int32_t>>;

/// H = 1 m; a domain without end, but for the axes given a period.
Scene unit_support(const Vec3& low = Vec3::Zero(), const Vec3& period = Vec3::Zero()) {
  Scene scene = open_scene();
  scene.particle_spacing = 0.5;
  for (int a = 0; a < 3; ++a)
    if (period[a] > 0) {
      scene.domain.periodic[a] = true;
      scene.domain.min[a] = low[a];
      scene.domain.max[a] = low[a] + period[a];
    }
  return scene;
}

/// j near i where some image of x_j is less than 1 m from x_i; i itself left out where `self`.
Lists by_definition(const Domain& domain, const Eigen::Matrix3Xd& of, const Eigen::Matrix3Xd& in, bool self) {
  Lists lists(static_cast<std::size_t>(of.cols()));
  for (Eigen::Index i = 0; i < of.cols(); ++i)
    for (Eigen::Index j = 0; j < in.cols(); ++j) {
      double squared = 0;
      for (int a = 0; a < 3; ++a) {
        const double period = domain.periodic[a] ? domain.max[a] - domain.min[a] : 0;
        const double gap = of(a, i) - in(a, j);
        const double least = std::min({std::abs(gap), std::abs(gap - period), std::abs(gap + period)});
        squared += least * least;
      }
      if (squared < 1 && !(self && i == j)) lists[static_cast<std::size_t>(i)].push_back(static_cast<std::int32_t>(j));
    }
  return lists;
}

/// The lists of one search; `out` holds another cloud's before, as it does from step to step.
Neighbors found(const Scene& scene, const Eigen::Matrix3Xd& fluid, const Eigen::Matrix3Xd& wall,
                NeighborSearch search) {
  Neighbors out;
  out.fluid = {{7, 8}, {9}};
  out.wall = {{1}};
  find_neighbors(scene, fluid, wall, search, out);
  return out;
}

/// True where both searches give what the definition gives.
bool agree(const Scene& scene, const Eigen::Matrix3Xd& fluid, const Eigen::Matrix3Xd& wall = Eigen::Matrix3Xd(3, 0)) {
  const Lists near_fluid = by_definition(scene.domain, fluid, fluid, true);
  const Lists near_wall = by_definition(scene.domain, fluid, wall, false);
  for (const auto search : {NeighborSearch::all_pairs, NeighborSearch::cells}) {
    const Neighbors n = found(scene, fluid, wall, search);
    if (n.fluid != near_fluid || n.wall != near_wall) return false;
  }
  return true;
}

/// Pairs of the lists whose distance is `shell` or less from 1 m: those a search beyond it gives.
Lists around_support(const Scene& scene, const Eigen::Matrix3Xd& of, const Eigen::Matrix3Xd& in, bool self,
                     double shell) {
  const Separation separation(scene.domain);
  Lists lists(static_cast<std::size_t>(of.cols()));
  for (Eigen::Index i = 0; i < of.cols(); ++i)
    for (Eigen::Index j = 0; j < in.cols(); ++j) {
      const double r = separation(Vec3(of.col(i)), Vec3(in.col(j))).norm();
      if (std::abs(r - 1) < shell && !(self && i == j))
        lists[static_cast<std::size_t>(i)].push_back(static_cast<std::int32_t>(j));
    }
  return lists;
}

/// Both searches' lists of a few points, as one.
Lists fluid_lists(const Scene& scene, const Eigen::Matrix3Xd& x) {
  EXPECT_TRUE(agree(scene, x));
  return found(scene, x, Eigen::Matrix3Xd(3, 0), NeighborSearch::cells).fluid;
}

Eigen::Matrix3Xd points(const std::vector<Vec3>& list) {
  Eigen::Matrix3Xd x(3, static_cast<Eigen::Index>(list.size()));
  for (Eigen::Index i = 0; i < x.cols(); ++i) x.col(i) = list[static_cast<std::size_t>(i)];
  return x;
}

TEST(Neighbors, AreTheSameByCellsAsByDefinitionInOpenSpace) {
  EXPECT_TRUE(rc::check("open cloud", [] {
    const double low = real(-100, 100), high = low + real(0.01, 12);
    RC_ASSERT(
        agree(unit_support(), any_cloud(integer(0, 150), low, high), any_cloud(integer(0, 60), low - 2, high + 1)));
  }));
}

TEST(Neighbors, AreTheSameByCellsAsByDefinitionOnPeriodicAxes) {
  EXPECT_TRUE(rc::check("periodic cloud", [] {
    // From less than one support radius around to more than eight, on one, two or three axes.
    const double low = real(-20, 20), size = real(0.3, 9);
    const int axes = integer(1, 3);
    const Vec3 period(size, axes > 1 ? real(0.3, 1) * size : 0, axes > 2 ? real(0.3, 1) * size : 0);
    const Scene scene = unit_support(Vec3::Constant(low), period);
    Eigen::Matrix3Xd fluid = any_cloud(integer(0, 150), 0, 1), wall = any_cloud(integer(0, 60), 0, 1);
    for (auto* x : {&fluid, &wall})
      for (int a = 0; a < 3; ++a) x->row(a) = x->row(a).array() * (period[a] > 0 ? period[a] : size) + low;
    RC_ASSERT(agree(scene, fluid, wall));
  }));
}

TEST(Neighbors, AreTheSameBesideThoseNearTheSupportsEnd) {
  EXPECT_TRUE(rc::check("shell", [] {
    const Scene scene = unit_support(Vec3::Zero(), coin() ? Vec3(5, 0, 4) : Vec3::Zero());
    const Eigen::Matrix3Xd fluid = any_cloud(integer(0, 120), 0, 4), wall = any_cloud(integer(0, 60), 0, 4);
    const double shell = real(0.001, 0.9);
    Neighbors out, near_H;
    near_H.fluid = {{3}};
    find_neighbors_and_shell(scene, fluid, wall, shell, out, near_H);
    const Neighbors expected = found(scene, fluid, wall, NeighborSearch::cells);
    RC_ASSERT(out.fluid == expected.fluid && out.wall == expected.wall);
    RC_ASSERT(near_H.fluid == around_support(scene, fluid, fluid, true, shell));
    RC_ASSERT(near_H.wall == around_support(scene, fluid, wall, false, shell));
  }));
}

TEST(Neighbors, AreAscendingAndMutualAndNeverOneself) {
  EXPECT_TRUE(rc::check("lists", [] {
    const Scene scene = unit_support(Vec3::Zero(), coin() ? Vec3(3, 0, 4) : Vec3::Zero());
    const Eigen::Matrix3Xd x = any_cloud(integer(2, 150), 0, 3);
    const Lists lists = found(scene, x, x, NeighborSearch::cells).fluid;
    for (std::size_t i = 0; i < lists.size(); ++i) {
      RC_ASSERT(std::adjacent_find(lists[i].begin(), lists[i].end(), std::greater_equal<>()) == lists[i].end());
      for (const auto j : lists[i]) {
        RC_ASSERT(j != static_cast<std::int32_t>(i) && j < x.cols());
        const auto& theirs = lists[static_cast<std::size_t>(j)];
        RC_ASSERT(std::count(theirs.begin(), theirs.end(), static_cast<std::int32_t>(i)) == 1);
      }
    }
  }));
}

TEST(Neighbors, EndAtTheSupportRadiusItself) {
  const double below = std::nextafter(1.0, 0.0), above = std::nextafter(1.0, 2.0);
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      const Vec3 step = sign * Vec3::Unit(axis);
      const auto pair = [&](double distance) {
        return fluid_lists(unit_support(), points({Vec3::Zero(), distance * step}))[0].size();
      };
      EXPECT_EQ(pair(below), 1);
      EXPECT_EQ(pair(1.0), 0);
      EXPECT_EQ(pair(above), 0);
    }
  Scene five = unit_support();
  five.particle_spacing = 2.5;  // H = 5, the diagonal of 3 × 4
  for (const auto search : {NeighborSearch::all_pairs, NeighborSearch::cells}) {
    const Eigen::Matrix3Xd at = points({Vec3(1, 1, 1), Vec3(4, 5, 1)});
    const Eigen::Matrix3Xd under = points({Vec3(1, 1, 1), Vec3(4, std::nextafter(5.0, 0.0), 1)});
    EXPECT_TRUE(found(five, at, at, search).fluid[0].empty());
    EXPECT_EQ(found(five, under, under, search).fluid[0].size(), 1u);
  }
}

TEST(Neighbors, AreRightOnALatticeWhosePairsAreExactlyASupportRadiusApart) {
  for (const double offset : {0.0, -7.0, 1e6}) {
    std::vector<Vec3> lattice;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 5; ++j)
        for (int k = 0; k < 4; ++k) lattice.emplace_back(offset + i, j - 2, k);
    for (const auto& list : fluid_lists(unit_support(), points(lattice))) EXPECT_TRUE(list.empty());
    for (const Vec3& period : {Vec3(6, 0, 0), Vec3(6, 5, 4)}) {
      const Scene scene = unit_support(Vec3(offset, -2, 0), period);
      for (const auto& list : fluid_lists(scene, points(lattice))) EXPECT_TRUE(list.empty());
    }
    // Half the lattice one ulp nearer to the other half.
    for (Vec3& x : lattice)
      if (x.x() - offset >= 3) x.x() = std::nextafter(x.x(), -1e9);
    EXPECT_EQ(fluid_lists(unit_support(), points(lattice))[3 * 20], std::vector<std::int32_t>{40});
  }
}

TEST(Neighbors, AreFoundAcrossAPeriodAtItsVeryEdges) {
  for (const double period : {0.7, 2.0, 2.9, 3.0, 3.1, 8.0}) {
    const Scene scene = unit_support(Vec3(-1, 0, 0), Vec3(period, 0, 0));
    const double end = -1 + period;
    const Lists lists =
        fluid_lists(scene, points({Vec3(-1, 0, 0), Vec3(end, 0.1, 0), Vec3(std::nextafter(end, -9), 0.2, 0)}));
    for (const auto& list : lists) EXPECT_EQ(list.size(), 2u) << period;
  }
}

TEST(Neighbors, DoNotMindALoneOutlier) {
  for (const double far : {1e6, -1e9, 1e15}) {
    Eigen::Matrix3Xd x = cloud(8, 100, 0, 4);
    x.col(37) = Vec3(far, -far, 0.5 * far);
    EXPECT_TRUE(agree(unit_support(), x, cloud(9, 30, -1, 5))) << far;
    EXPECT_TRUE(agree(unit_support(), cloud(9, 100, -1, 5), x)) << far;
  }
}

TEST(Neighbors, AreEachOtherInOnePoint) {
  const Eigen::Matrix3Xd x = Vec3(-3.7, 0.2, 11).replicate(1, 50);
  for (const Vec3& period : {Vec3(0, 0, 0), Vec3(5, 5, 5)})
    for (const auto& list : fluid_lists(unit_support(Vec3(-5, 0, 9), period), x)) EXPECT_EQ(list.size(), 49u);
}

TEST(Neighbors, AreNoneWithoutParticles) {
  const Eigen::Matrix3Xd none(3, 0), some = cloud(3, 20, 0, 2);
  EXPECT_TRUE(agree(unit_support(), none, none));
  EXPECT_TRUE(agree(unit_support(), none, some));
  EXPECT_TRUE(agree(unit_support(), some, none));
  EXPECT_TRUE(agree(unit_support(), some.leftCols(1), none));
}

TEST(Neighbors, AreRightFarFromTheOriginAndInAPlane) {
  for (const double offset : {-1e6, 1e8}) {
    Eigen::Matrix3Xd x = cloud(4, 150, 0, 5).array() + offset;
    EXPECT_TRUE(agree(unit_support(), x, cloud(5, 50, -1, 6).array() + offset)) << offset;
    x.row(1).setConstant(offset);
    EXPECT_TRUE(agree(unit_support(), x)) << offset;
    x.row(2).setConstant(-offset);
    EXPECT_TRUE(agree(unit_support(), x)) << offset;
  }
}

TEST(Neighbors, AreRightWhereCellsMustGrowToStayFew) {
  Eigen::Matrix3Xd x = cloud(6, 200, 0, 1000);
  for (Eigen::Index i = 100; i < 200; ++i) x.col(i) = x.col(i - 100).array() + 0.3;
  EXPECT_TRUE(agree(unit_support(), x, x.array() + 0.1));
  const Scene periodic = unit_support(Vec3::Constant(0), Vec3::Constant(1001));
  EXPECT_TRUE(agree(periodic, x, x.array() + 0.1));
}

TEST(Separation, IsTheShortestWayRoundAPeriod) {
  EXPECT_TRUE(rc::check("nearest image, antisymmetric", [] {
    const double period = real(0.5, 5);
    const Separation separation(unit_support(Vec3::Zero(), Vec3(period, 0, period)).domain);
    const Vec3 a = vec(0, period), b = vec(0, period), ab = separation(a, b);
    RC_ASSERT(ab == -separation(b, a));
    RC_ASSERT(ab.y() == a.y() - b.y());
    for (const int axis : {0, 2}) {
      RC_ASSERT(std::abs(ab[axis]) <= period / 2 * (1 + 1e-15));
      const double turns = (a[axis] - b[axis] - ab[axis]) / period;
      RC_ASSERT(std::abs(turns - std::round(turns)) <= 1e-14);
    }
  }));
}

}  // namespace
}  // namespace decant::test
