/// \file
/// Fixtures come back bitwise and are as their document says.
#include "oracle/files/fixture_file.hpp"
#include "oracle/solution/digest.hpp"
#include "tests/small_fixture.hpp"
#include "tests/special_values.hpp"

namespace decant {
namespace {

using test::nan;

TEST_F(FixtureFile, EverythingComesBackBitwise) {
  const Fixture sent = small_fixture(), back = read_fixture(file_);
  EXPECT_EQ(back.name, "beaker-settled");
  EXPECT_EQ(back.phase, "settled");
  EXPECT_EQ(back.sha256, sha256_of_file(file_));
  EXPECT_EQ(scene_to_json(back.scene), scene_to_json(sent.scene));
  EXPECT_EQ(back.state.substep, 250);
  EXPECT_EQ(back.state.position, sent.state.position);
  EXPECT_EQ(back.state.velocity, sent.state.velocity);
  EXPECT_EQ(back.fields->boundary_volume, sent.fields->boundary_volume);
  EXPECT_EQ(back.fields->pressure, sent.fields->pressure);
  EXPECT_EQ(back.fields->wall_viscous_acceleration, sent.fields->wall_viscous_acceleration);
  EXPECT_EQ(back.fields->wall_neighbor_id_sum, sent.fields->wall_neighbor_id_sum);
  EXPECT_EQ(back.condition->density_pose, sent.condition->density_pose);
  EXPECT_EQ(back.condition->wall_viscous_acceleration, sent.condition->wall_viscous_acceleration);
  EXPECT_EQ(digest_of(*back.fields), digest_of(*sent.fields));
  EXPECT_EQ(back.provenance.at("compiler"), "g++");
  EXPECT_EQ(back.provenance.at("scene_sha256"), sha256_of_text(scene_to_json(sent.scene)));
}

TEST_F(FixtureFile, RecordingTwiceGivesTheSameBytes) {
  const std::string first = bytes();
  write_fixture(file_, small_fixture());
  EXPECT_EQ(bytes(), first);
}

TEST_F(FixtureFile, AStudyScaleFixtureHoldsDigestAndSampleAlone) {
  const Fixture whole = small_fixture();
  Fixture study = small_fixture();
  reduce_to_sample(study, 10);
  write_fixture(file_, study);
  const Fixture back = read_fixture(file_);
  EXPECT_TRUE(back.study_scale());
  EXPECT_FALSE(back.condition.has_value());
  EXPECT_EQ(back.fields_digest, digest_of(*whole.fields));
  ASSERT_EQ(back.sample_id.size(), 10);
  for (Eigen::Index k = 0; k < 10; ++k) {
    const auto i = back.sample_id[k];
    EXPECT_EQ(back.sample_density[k], whole.fields->density[i]);
    EXPECT_EQ(back.sample_pressure[k], whole.fields->pressure[i]);
    EXPECT_EQ(back.sample_acceleration.col(k), whole.fields->acceleration.col(i));
  }
}

TEST_F(FixtureFile, AnEmptyCupIsAFixtureLikeAnyOther) {
  Fixture f = small_fixture();
  f.state.position.resize(3, 0);
  f.state.velocity.resize(3, 0);
  const Eigen::VectorXd volumes = f.fields->boundary_volume;
  f.fields = Fields::unwritten(0, volumes.size());
  f.fields->boundary_volume = volumes;
  f.condition = ConditionSums{};
  write_fixture(file_, f);
  EXPECT_EQ(read_fixture(file_).state.size(), 0);
}

TEST_F(FixtureFile, WhatWouldBeRefusedIsNotWritten) {
  const std::string before = bytes();
  Fixture f = small_fixture();
  f.state.position(1, 2) = 0.1;
  try {
    write_fixture(file_, f);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/state/position"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("0.1 at 2, y"), std::string::npos) << error.what();
  }
  f = small_fixture();
  f.fields->density[3] = nan;
  EXPECT_THROW(write_fixture(file_, f), std::runtime_error);
  EXPECT_EQ(bytes(), before);
}

TEST_F(FixtureFile, Sha256IsThatOfTheStandard) {
  EXPECT_EQ(sha256_of_text("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace decant
