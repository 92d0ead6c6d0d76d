/// \file
/// Which rank owns which part of space: boxes by recursive bisection, so that each holds its share of the work.
#pragma once

#include "gpu/core/device_scene.hpp"

#include <vector>

namespace decant::gpu {

/// The most ranks there can be: a set of them is a word.
inline constexpr int most_ranks = 64;

/// A particle that stands for others: where, m, and what share of the work is there, in any unit.
struct WorkSample {
  Float3 position;
  float work;
};

/// One box a rank, x in [min, max) along each axis; together they are all of space, so the outer ones are infinite.
/// Samples that are not finite are left out.
std::vector<Box> bisect(std::vector<WorkSample> samples, int ranks);

/// Most of the values by their mean; 1 where all are equal or zero.
double imbalance(const std::vector<double>& work);

}  // namespace decant::gpu
