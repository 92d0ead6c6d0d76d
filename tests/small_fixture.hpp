/// \file
/// A small fixture in a folder of its own, and the ways to damage it.
#pragma once

#include "oracle/files/fixture_file.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "oracle/solution/digest.hpp"
#include "oracle/solution/fixture.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_file.hpp"
#include "reference/shapes.hpp"
#include "tests/file_bytes.hpp"

#include <gtest/gtest.h>

#include <hdf5.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>

#include <unistd.h>

namespace decant {

inline Scene small_scene() {
  Scene scene;
  scene.name = "beaker";
  scene.particle_spacing = 0.01;
  scene.domain = {Vec3(-0.2, -0.2, -0.2), Vec3(0.2, 0.2, 0.4), {false, false, false}};
  Container cup;
  cup.name = "cup";
  cup.shape = cup_shape(0.035, 0.09, 0.03);
  cup.wall_thickness = 0.03;
  scene.containers = {cup};
  Fill fill;
  fill.container = "cup";
  fill.level = 0.03;
  scene.fills = {fill};
  scene.schedule.end = 1.0;
  scene.schedule.frames = 10;
  scene.schedule.substeps_per_frame = 100;
  return scene;
}

inline Eigen::VectorXd positive(Eigen::Index n) { return Eigen::VectorXd::Random(n).array().abs() + 0.5; }

/// A fixture whose fields are of the right kind; what they are does not matter to a file.
inline Fixture small_fixture() {
  std::srand(7);
  Fixture f;
  f.phase = "settled";
  f.scene = small_scene();
  f.state = initial_state(f.scene);
  f.state.substep = 250;
  f.state.velocity.setRandom();
  f.state.quantise();
  const Eigen::Index n = f.state.size(), m = sample_walls(f.scene).size();
  Fields& fields = f.fields.emplace(Fields::unwritten(n, m));
  fields.boundary_volume = positive(m);
  fields.density = positive(n);
  fields.pressure.setRandom();
  for (auto* a : {&fields.acceleration, &fields.pressure_acceleration, &fields.viscous_acceleration,
                  &fields.wall_pressure_acceleration, &fields.wall_viscous_acceleration})
    a->setRandom();
  for (auto* c : {&fields.fluid_neighbor_count, &fields.fluid_neighbor_id_sum, &fields.wall_neighbor_count,
                  &fields.wall_neighbor_id_sum})
    *c = IdVector::LinSpaced(n, 0, n - 1);
  ConditionSums& sums = f.condition.emplace();
  sums.density = sums.density_pose = positive(n);
  sums.pressure_acceleration = fields.acceleration.cwiseAbs();
  sums.viscous_acceleration = sums.wall_pressure_acceleration = sums.wall_viscous_acceleration =
      sums.pressure_acceleration;
  f.ensemble = {20, 8, {1e-8, 2e-8, 3e-7, 4e-7, 5e-9}, {1e-9, 2e-9, 3e-8, 4e-8, 5e-10}};
  f.provenance = {{"version", "0"}, {"compiler", "g++"}};
  return f;
}

class FixtureFile : public testing::Test {
 protected:
  void SetUp() override { write_fixture(file_, small_fixture()); }

  std::string bytes() const { return test::bytes_of(file_); }
  void replace_bytes(const std::string& content) const {
    std::ofstream(file_, std::ios::binary | std::ios::trunc) << content;
  }
  /// Edits the file in place as a stranger's program would.
  void edit(const std::function<void(hid_t)>& change) const {
    const hid_t file = H5Fopen(file_.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    ASSERT_GE(file, 0);
    change(file);
    H5Fclose(file);
  }
  void remove(const std::string& path) const {
    edit([&](hid_t file) { H5Ldelete(file, path.c_str(), H5P_DEFAULT); });
  }
  void remove_attribute(const std::string& object, const std::string& name) const {
    edit([&](hid_t file) { H5Adelete_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT); });
  }
  /// Sets the first value of a dataset.
  void spoil(const std::string& path, double value) const {
    edit([&](hid_t file) {
      const hid_t data = H5Dopen2(file, path.c_str(), H5P_DEFAULT);
      const hid_t space = H5Dget_space(data);
      std::vector<double> all(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
      H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data());
      all[0] = value;
      H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data());
      H5Sclose(space);
      H5Dclose(data);
    });
  }
  /// Puts a dataset of other type or shape in a dataset's place, filled with ones.
  void reshape(const std::string& path, const std::vector<hsize_t>& dims, hid_t type = H5T_IEEE_F64LE) const {
    edit([&](hid_t file) {
      if (H5Lexists(file, path.c_str(), H5P_DEFAULT) > 0) H5Ldelete(file, path.c_str(), H5P_DEFAULT);
      hsize_t count = 1;
      for (const hsize_t n : dims) count *= n;
      const hid_t space = H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr);
      const hid_t data = H5Dcreate2(file, path.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
      if (count < 1'000'000) {
        const std::vector<double> ones(count, 1.0);
        H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, ones.data());
      }
      H5Dclose(data);
      H5Sclose(space);
    });
  }
  template <typename T>
  void set_attribute(const std::string& object, const std::string& name, hid_t type, const T& value) const {
    write_attribute(object, name, type, &value);
  }
  void write_attribute(const std::string& object, const std::string& name, hid_t type, const void* value) const {
    edit([&](hid_t file) {
      H5Adelete_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT);
      const hid_t space = H5Screate(H5S_SCALAR);
      const hid_t attribute =
          H5Acreate_by_name(file, object.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
      H5Awrite(attribute, type, value);
      H5Aclose(attribute);
      H5Sclose(space);
    });
  }
  void set_text(const std::string& object, const std::string& name, const std::string& text) const {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, text.size() + 1);
    write_attribute(object, name, type, text.c_str());
    H5Tclose(type);
  }
  /// Another scene text with the digest that belongs to it.
  void set_scene(const std::string& text) const {
    remove("/scene");
    edit([&](hid_t file) {
      const hid_t type = H5Tcopy(H5T_C_S1);
      H5Tset_size(type, text.size());
      const hid_t space = H5Screate(H5S_SCALAR);
      const hid_t data = H5Dcreate2(file, "/scene", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
      H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data());
      H5Dclose(data);
      H5Sclose(space);
      H5Tclose(type);
    });
    set_text("/provenance", "scene_sha256", sha256_of_text(text));
  }

  /// Asserts that the file is refused, naming it, the key, and these parts of value and bound.
  void expect_refused(const std::string& key, const std::string& value, const std::string& bound) const {
    try {
      read_fixture(file_);
      ADD_FAILURE() << "was accepted; expected a complaint about " << key;
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), file_.string());
      EXPECT_EQ(error.key(), key) << error.what();
      EXPECT_NE(error.value().find(value), std::string::npos) << error.what();
      EXPECT_NE(error.bound().find(bound), std::string::npos) << error.what();
    }
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "beaker-settled.h5";
};

}  // namespace decant
