/// \file
/// Where two pours of one scene part: frame by frame and field by field, beside the spread of pours
/// that differ in nothing but a start perturbed in its last bits.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace decant::pour {

/// What is compared of a frame. Over particles: the root mean square of |x_a − x_b| by the nearest
/// image, of |v_a − v_b|, of the differences in density and pressure; how many particles are in
/// another place (source, receiver, …). Of the sums: |a − b| of the kinetic energy, which is told and
/// not judged, because one number of a few pours may be near by chance.
inline constexpr std::array<const char*, 6> compared_fields = {"position", "velocity",  "density",
                                                               "pressure", "elsewhere", "kinetic_energy"};
inline constexpr std::array<const char*, 6> compared_field_units = {"dx", "m/s", "kg/m^3", "Pa", "particles", "J"};
inline constexpr std::size_t judged_fields = 5;
using FieldDistances = std::array<double, compared_fields.size()>;

struct FrameDifference {
  std::int64_t frame = 0;
  double time = 0;            // s
  FieldDistances distance{};  // of the two; NaN where a value of either is no number
  double farthest = 0;        // dx, the largest |x_a − x_b|
  std::int64_t farthest_particle = -1;
  FieldDistances spread{};  // the largest distance of any two pours of the spread until then
};

/// Two pours apart.
struct Difference {
  std::int64_t particles = 0;
  std::int64_t frames_missing = 0;  // of the scene's, not written in both
  std::int64_t spread_pours = 0;    // BEFORE and those given beside; 0: no spread is known
  double factor = 3;
  std::vector<FrameDifference> frames;

  /// The first frame in which any value differs; −1: none.
  std::int64_t first_difference() const;
  /// The fields in which that frame differs.
  std::vector<std::string> first_fields() const;

  /// The first frame and field whose distance is more than factor times the largest spread up to
  /// that frame, one particle elsewhere being no less than the spread; frame −1: none. Without a spread
  /// every difference is beyond it.
  struct Beyond {
    std::int64_t frame = -1;
    std::size_t field = 0;
    double times = 0;  // of the spread; infinite where that is 0
  };
  Beyond beyond() const;
  bool within() const { return beyond().frame < 0; }
};

/// True where the path is a pour's folder, or its frames.h5.
bool is_pour(const std::filesystem::path& path);

/// Reads the frames that all of the pours have. \param spread  pours of the same scene from perturbed
/// starts; with `before` they make the spread. Throws InputError where a folder holds no frames, or
/// another scene or another number of particles than `before`.
Difference difference(const std::filesystem::path& before, const std::filesystem::path& after,
                      const std::vector<std::filesystem::path>& spread, double factor = 3);

/// For a terminal, at most 100 columns: some of the frames, last one line for the whole.
std::string difference_text(const Difference& diff);

/// That line.
std::string difference_line(const Difference& diff);

/// All of it. \param exit_status  what the command ends with
std::string difference_json(const Difference& diff, int exit_status);

}  // namespace decant::pour
