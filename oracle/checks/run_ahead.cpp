/// \file
/// Segments of a run, and what the reference's shows at their ends.
#include "oracle/checks/run_ahead.hpp"

#include "oracle/checks/advanced_check.hpp"
#include "oracle/checks/audit.hpp"

#include <algorithm>
#include <set>

namespace decant {

std::vector<Segment> segments_of(const Fixture& fixture, int sample_every) {
  const auto substeps = static_cast<int>(fixture.ensemble.substeps);
  const std::vector<int> viewed = viewed_after(fixture.state.size(), substeps);
  std::set<int> ends(viewed.begin(), viewed.end());
  for (int done = sample_every > 0 || viewed.empty() ? 0 : viewed.back(); done < substeps; ends.insert(done)) {
    const int left = substeps - done;
    done += sample_every > 0 ? std::min(sample_every, left) : (left + 1) / 2;
  }
  std::vector<Segment> all;
  int last = 0;
  for (const int end : ends) {
    all.push_back({end - last, std::ranges::find(viewed, end) != viewed.end()});
    last = end;
  }
  return all;
}

void run_ahead(const Fixture& fixture, PreparedReference& prepared, const std::function<ParticleState(int)>& advance) {
  Audit audit(fixture.scene);
  audit.sample(fixture.state);
  std::int64_t done = 0;
  for (const Segment& segment : prepared.segments) {
    prepared.later = advance(segment.substeps);
    if (4 * done < fixture.ensemble.substeps) ++prepared.repeated;
    done += segment.substeps;
    prepared.later_sample = audit.sample(prepared.later);
    prepared.deepest = std::max(prepared.deepest, prepared.later_sample.deepest);
    prepared.crossed = std::max(prepared.crossed, prepared.later_sample.crossed);
  }
}

}  // namespace decant
