/// \file
/// What of a fixture of study scale is kept.
#include "oracle/solution/fixture.hpp"

#include "oracle/solution/digest.hpp"

#include <stdexcept>

namespace decant {

void reduce_to_sample(Fixture& f, Eigen::Index count) {
  if (!f.fields) throw std::invalid_argument("reduce_to_sample: the fixture holds no fields");
  const Fields& all = *f.fields;
  const Eigen::Index n = f.state.size();
  count = std::min(count, n);
  f.fields_digest = digest_of(all);
  f.sample_id.resize(count);
  f.sample_density.resize(count);
  f.sample_pressure.resize(count);
  f.sample_acceleration.resize(3, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index i = k * n / count;
    f.sample_id[k] = i;
    f.sample_density[k] = all.density[i];
    f.sample_pressure[k] = all.pressure[i];
    f.sample_acceleration.col(k) = all.acceleration.col(i);
  }
  f.fields.reset();
  f.condition.reset();
}

}  // namespace decant
