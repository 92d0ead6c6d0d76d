/// \file
/// A port of their solver against their reference: the tolerance is what the reference states, term
/// by term, and where it states none nothing passes.
#include "oracle/files/named_fields.hpp"

#include "oracle/files/hdf5_handle.hpp"
#include "tests/results_fixture.hpp"

#include <cmath>
#include <limits>

namespace decant {
namespace {

/// A reference of one field "x" of four particles, and the port's answer to it.
class NamedFields : public test::ResultsFile {
 protected:
  void SetUp() override { x_ << 1, -2, 3, 4; }

  static void reference(const std::function<void(Hdf5Writer&)>& fill) {
    Hdf5Writer out(reference_file());
    out.attribute("/", "decant_reference", 1);
    fill(out);
    out.commit();
  }
  static void port(const std::function<void(Hdf5Writer&)>& fill) {
    Hdf5Writer out(results_file());
    out.attribute("/", "decant_results", 1);
    fill(out);
    out.commit();
  }
  static ResultsOutcome judged() { return check_results_file({results_file(), {}, reference_file(), "port", {}}); }
  /// Status where the port's particle 2 is off by `error`.
  int status_off_by(double error) const {
    Eigen::VectorXd off = x_;
    off[2] += error;
    port([&](Hdf5Writer& out) { out.vector("/fields/x", off, ""); });
    return judged().status;
  }

  Eigen::VectorXd x_ = Eigen::VectorXd(4);
};

TEST_F(NamedFields, AreBoundByTheirConditionSums) {
  const auto bounded = [&](const std::function<void(Hdf5Writer&)>& more) {
    reference([&](Hdf5Writer& out) {
      out.vector("/fields/x", x_, "");
      out.vector("/condition/x", Eigen::VectorXd::Constant(4, 10.0), "");
      more(out);
    });
  };
  const auto expect_bound = [&](double bound) {
    EXPECT_EQ(status_off_by(0.999 * bound), 0) << bound;
    EXPECT_EQ(status_off_by(1.001 * bound), 1) << bound;
  };
  bounded([](Hdf5Writer& out) { out.integers("/terms/x", IdVector::LinSpaced(4, 9, 36)); });
  expect_bound((std::sqrt(27.0) + 8) * 0x1p-24 * 10);
  bounded([](Hdf5Writer& out) { out.attribute("/condition/x", "terms", 100); });
  expect_bound((10 + 8) * 0x1p-24 * 10);
  bounded([](Hdf5Writer& out) {
    out.attribute("/condition/x", "terms", 100);
    out.attribute("/condition/x", "c", 2.0);
    out.attribute("/condition/x", "precision", 0x1p-11);
    out.attribute("/fields/x", "tolerance", 0.5);
  });
  expect_bound((10 + 2) * 0x1p-11 * 10 + 0.5);
}

/// Two sums in double differ by the roundings of both.
TEST_F(NamedFields, OfAPortInDoubleAreBoundByBothSidesRounding) {
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.vector("/condition/x", Eigen::VectorXd::Constant(4, 10.0), "");
    out.attribute("/condition/x", "terms", 100);
    out.attribute("/condition/x", "precision", 0x1p-53);
  });
  const double bound = (10 + 8) * (0x1p-53 + 0x1p-53) * 10;
  EXPECT_EQ(status_off_by(0.9 * bound), 0);
  EXPECT_EQ(status_off_by(1.1 * bound), 1);
}

/// A reference in single precision rounds as its port does.
TEST_F(NamedFields, AreBoundByWhatTheReferenceSaysOfItsOwnPrecision) {
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.vector("/condition/x", Eigen::VectorXd::Constant(4, 10.0), "");
    out.attribute("/condition/x", "terms", 100);
    out.attribute("/condition/x", "reference_precision", 0x1p-24);
  });
  const double bound = (10 + 8) * (0x1p-24 + 0x1p-24) * 10;
  EXPECT_EQ(status_off_by(0.999 * bound), 0);
  EXPECT_EQ(status_off_by(1.001 * bound), 1);
}

TEST_F(NamedFields, MayHaveATolerancePerValue) {
  Eigen::VectorXd each(4);
  each << 0, 0, 0.5, 0;
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.vector("/tolerance/x", each, "");
    out.attribute("/fields/x", "tolerance", 0.25);
  });
  EXPECT_EQ(status_off_by(0.7499), 0);
  EXPECT_EQ(status_off_by(0.7501), 1);
  each[2] = -1;
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.vector("/tolerance/x", each, "");
  });
  expect_refused(judged, "/tolerance/x");
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.attribute("/fields/x", "tolerance", 0.25);
    out.vector("/tolerance/y", each, "");
  });
  expect_refused(judged, "/tolerance/y");
}

/// One per particle counts for all its components.
TEST_F(NamedFields, OfVectorsMayHaveATolerancePerParticle) {
  const Eigen::Matrix3Xd v = Eigen::Matrix3Xd::Constant(3, 2, 1.0);
  reference([&](Hdf5Writer& out) {
    out.matrix3("/fields/v", v, "");
    out.vector("/tolerance/v", Eigen::Vector2d(0, 0.5), "");
  });
  const auto off = [&](Eigen::Index particle) {
    Eigen::Matrix3Xd other = v;
    other(2, particle) += 0.4;
    port([&](Hdf5Writer& out) { out.matrix3("/fields/v", other, ""); });
    return judged().status;
  };
  EXPECT_EQ(off(0), 1);
  EXPECT_EQ(off(1), 0);
}

void put_shaped(Hdf5Writer& out, const std::string& path, const std::vector<hsize_t>& shape,
                const Eigen::VectorXd& values) {
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE));
  const Handle made = make_dataset(out.id(), path, H5T_NATIVE_DOUBLE, shape, creation);
  H5Dwrite(made.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
}

TEST_F(NamedFields, MayBeTensors) {
  Eigen::VectorXd stress = Eigen::VectorXd::LinSpaced(18, 1, 18);
  reference([&](Hdf5Writer& out) {
    put_shaped(out, "/fields/stress", {2, 3, 3}, stress);
    out.attribute("/fields/stress", "tolerance", 0.25);
    put_shaped(out, "/position", {2, 2}, Eigen::Vector4d(1, 2, 3, 4));
  });
  port([&](Hdf5Writer& out) { put_shaped(out, "/fields/stress", {2, 3, 3}, stress); });
  EXPECT_EQ(judged().status, 0);
  EXPECT_EQ(row_of(judged(), "fields", "stress").n, 18);
  stress[9 + 5] += 1;
  port([&](Hdf5Writer& out) { put_shaped(out, "/fields/stress", {2, 3, 3}, stress); });
  const ResultsOutcome outcome = judged();
  EXPECT_EQ(outcome.status, 1);
  const CheckRow& row = row_of(outcome, "fields", "stress");
  EXPECT_EQ(row.worst_id, 1);
  EXPECT_EQ(row.worst_component, -1);
  EXPECT_EQ(row.reason, "beyond tolerance at entry [1,2]");
  EXPECT_EQ(row.worst_x, 3);
  EXPECT_EQ(row.worst_y, 4);
  EXPECT_EQ(row.worst_z, 0);
  EXPECT_NE(outcome.table.find("    actual 16, expected 15; at (3, 4, 0) m"), std::string::npos) << outcome.table;
  port([&](Hdf5Writer& out) { put_shaped(out, "/fields/stress", {2, 9}, stress); });
  expect_refused(judged, "/fields/stress");
  port([&](Hdf5Writer& out) { put_shaped(out, "/fields/stress", {2, 3, 1025}, Eigen::VectorXd::Zero(6150)); });
  expect_refused(judged, "/fields/stress");
}

TEST_F(NamedFields, MayBeSoLargeThatTheirSquaresOverflow) {
  x_ *= 1e300;
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.attribute("/fields/x", "relative", 1e-3);
  });
  EXPECT_EQ(status_off_by(0), 0);
  const double bound = 1e-3 * std::sqrt((1.0 + 4 + 9 + 16) / 4) * 1e300;
  EXPECT_EQ(status_off_by(0.999 * bound), 0);
  EXPECT_EQ(status_off_by(1.001 * bound), 1);
}

TEST_F(NamedFields, WhoseToleranceOverflowsAreRefusedByName) {
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.vector("/condition/x", Eigen::VectorXd::Constant(4, 1e300), "");
    out.attribute("/condition/x", "terms", 100);
    out.attribute("/condition/x", "c", 1e300);
  });
  port([&](Hdf5Writer& out) { out.vector("/fields/x", x_, ""); });
  expect_refused(judged, "/fields/x");
}

TEST_F(NamedFields, AreBoundByStatedTolerances) {
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.attribute("/fields/x", "tolerance", 0.25);
    out.attribute("/fields/x", "relative", 0.5);
  });
  const double bound = 0.25 + 0.5 * std::sqrt((1.0 + 4 + 9 + 16) / 4);
  EXPECT_EQ(status_off_by(0.999 * bound), 0);
  EXPECT_EQ(status_off_by(1.001 * bound), 1);
  EXPECT_EQ(row_of(judged(), "fields", "x").worst_id, 2);
}

TEST_F(NamedFields, WithoutAToleranceAreNotRun) {
  reference([&](Hdf5Writer& out) { out.vector("/fields/x", x_, ""); });
  EXPECT_EQ(status_off_by(0), 3);
  const ResultsOutcome outcome = judged();
  EXPECT_EQ(row_of(outcome, "fields", "x").verdict, Verdict::not_run);
  EXPECT_NE(row_of(outcome, "fields", "x").reason.find("no tolerance"), std::string::npos);
}

TEST_F(NamedFields, TakeNoToleranceFromThePort) {
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.attribute("/fields/x", "tolerance", 0.25);
  });
  port([&](Hdf5Writer& out) {
    out.vector("/fields/x", 2 * x_, "");
    out.attribute("/fields/x", "tolerance", 100.0);
  });
  EXPECT_EQ(judged().status, 1);
}

TEST_F(NamedFields, FailWhereAValueIsNoNumber) {
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.attribute("/fields/x", "tolerance", 1e9);
  });
  EXPECT_EQ(status_off_by(std::nan("")), 1);
  EXPECT_EQ(status_off_by(std::numeric_limits<double>::infinity()), 1);
}

TEST_F(NamedFields, OfIntegersAreExact) {
  reference([](Hdf5Writer& out) { out.integers("/fields/count", IdVector::LinSpaced(4, 1, 4)); });
  port([](Hdf5Writer& out) { out.integers("/fields/count", IdVector::LinSpaced(4, 1, 4)); });
  EXPECT_EQ(judged().status, 0);
  port([](Hdf5Writer& out) { out.integers("/fields/count", IdVector::LinSpaced(4, 0, 3)); });
  EXPECT_EQ(judged().status, 1);
}

TEST_F(NamedFields, MayHaveSeveralStatesAndVectors) {
  const Eigen::Matrix3Xd v = Eigen::Matrix3Xd::Constant(3, 5, 2.0);
  reference([&](Hdf5Writer& out) {
    for (const char* state : {"/early", "/late"}) {
      out.matrix3(std::string(state) + "/fields/v", v, "m/s");
      out.attribute(std::string(state) + "/fields/v", "tolerance", 0.1);
    }
  });
  Eigen::Matrix3Xd off = v;
  off(1, 3) += 0.2;
  port([&](Hdf5Writer& out) { out.matrix3("/early/fields/v", v, "m/s"); });
  EXPECT_EQ(judged().status, 0);
  EXPECT_EQ(row_of(judged(), "fields", "v").fixture, "reference/early");
  EXPECT_EQ(exit_status(judged().report), 3) << "late is not there";
  port([&](Hdf5Writer& out) {
    out.matrix3("/early/fields/v", v, "m/s");
    out.matrix3("/late/fields/v", off, "m/s");
  });
  EXPECT_EQ(judged().status, 1);
  EXPECT_EQ(judged().report.rows[1].worst_id, 3);
  EXPECT_EQ(judged().report.rows[1].n, 15);
}

TEST_F(NamedFields, OfStatesThatAreMissingAreNamedAndCounted) {
  reference([&](Hdf5Writer& out) {
    for (const char* state : {"/early", "/middle", "/late"}) {
      out.vector(std::string(state) + "/fields/x", x_, "");
      out.attribute(std::string(state) + "/fields/x", "tolerance", 0.1);
    }
  });
  port([&](Hdf5Writer& out) { out.vector("/middle/fields/x", x_, ""); });
  const ResultsOutcome outcome = judged();
  EXPECT_NE(outcome.line.find("2 of 3 states missing: /early, /late"), std::string::npos) << outcome.line;
  EXPECT_NE(outcome.table.find(outcome.line), std::string::npos);
  port([&](Hdf5Writer& out) {
    for (const char* state : {"/early", "/middle", "/late"}) out.vector(std::string(state) + "/fields/x", x_, "");
  });
  EXPECT_EQ(judged().line.find("missing"), std::string::npos);
}

/// Squares of these are beyond all numbers, or nothing.
TEST_F(NamedFields, MayBeOfAnySize) {
  x_ << 1e300, 1e-300, 0, 5;
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.attribute("/fields/x", "relative", 1e-6);
  });
  EXPECT_EQ(status_off_by(0), 0);
  // RMS = 1e300/√4.
  const double tau = 1e-6 * 1e300 / 2;
  EXPECT_NEAR(row_of(judged(), "fields", "x").tolerance / tau, 1, 1e-12);
  EXPECT_EQ(status_off_by(0.99 * tau), 0);
  EXPECT_EQ(status_off_by(1.01 * tau), 1);
  x_ << 1e-300, 0, 0, 0;
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.attribute("/fields/x", "relative", 1.0);
  });
  EXPECT_EQ(status_off_by(0.9 * 1e-300 / 2), 0);
  EXPECT_EQ(status_off_by(1.1 * 1e-300 / 2), 1);
}

TEST_F(NamedFields, WithAToleranceBeyondAllNumbersAreRefused) {
  x_ << 1e308, 1, 2, 3;
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.attribute("/fields/x", "relative", 10.0);
  });
  port([&](Hdf5Writer& out) { out.vector("/fields/x", x_, ""); });
  try {
    (void)judged();
    FAIL() << "must be refused";
  } catch (const InputError& error) {
    EXPECT_EQ(error.key(), "/fields/x");
    EXPECT_NE(error.value().find("a tolerance beyond"), std::string::npos) << error.value();
  }
}

TEST_F(NamedFields, AreMatchedByIdInBothFiles) {
  IdVector ids(4), others(4);
  ids << 10, 30, 20, 40;
  others << 40, 30, 20, 10;
  const auto put = [](Hdf5Writer& out, const IdVector& id, const Eigen::VectorXd& values) {
    out.integers("/id", id);
    out.vector("/fields/x", values, "");
  };
  reference([&](Hdf5Writer& out) {
    put(out, ids, x_);
    out.attribute("/fields/x", "tolerance", 0.1);
  });
  Eigen::VectorXd turned(4);
  turned << x_[3], x_[1], x_[2], x_[0];
  port([&](Hdf5Writer& out) { put(out, others, turned); });
  EXPECT_EQ(judged().status, 0);
  turned[1] += 1;
  port([&](Hdf5Writer& out) { put(out, others, turned); });
  EXPECT_EQ(judged().status, 1);
  EXPECT_EQ(row_of(judged(), "fields", "x").worst_id, 30);

  others[0] = 30;
  port([&](Hdf5Writer& out) { put(out, others, turned); });
  EXPECT_EQ(judged().status, 1);
  EXPECT_EQ(row_of(judged(), "ids", "id").reason, "id 40 is missing, id 30 is there 2 times");
  EXPECT_EQ(row_of(judged(), "fields", "x").verdict, Verdict::not_run);
}

TEST_F(NamedFields, ThatTheReferenceDoesNotHaveAreNotRun) {
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.attribute("/fields/x", "tolerance", 0.25);
  });
  port([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "");
    out.vector("/fields/y", x_, "");
  });
  EXPECT_EQ(judged().status, 3);
  EXPECT_EQ(row_of(judged(), "fields", "y").verdict, Verdict::not_run);
}

TEST_F(NamedFields, OfAnotherShapeOrUnitAreRefused) {
  reference([&](Hdf5Writer& out) {
    out.vector("/fields/x", x_, "m");
    out.attribute("/fields/x", "tolerance", 0.25);
  });
  port([&](Hdf5Writer& out) { out.vector("/fields/x", x_.head(3), "m"); });
  expect_refused(judged, "/fields/x");
  port([&](Hdf5Writer& out) { out.matrix3("/fields/x", Eigen::Matrix3Xd::Zero(3, 4), "m"); });
  expect_refused(judged, "/fields/x");
  port([&](Hdf5Writer& out) { out.vector("/fields/x", x_, "mm"); });
  expect_refused(judged, "/fields/x@unit");
}

TEST_F(NamedFields, NeedAReferenceThatIsSound) {
  port([&](Hdf5Writer& out) { out.vector("/fields/x", x_, ""); });
  const auto with = [&](const std::function<void(Hdf5Writer&)>& more) {
    reference([&](Hdf5Writer& out) {
      out.vector("/fields/x", x_, "");
      more(out);
    });
  };
  with([](Hdf5Writer& out) { out.attribute("/fields/x", "tolerance", -1.0); });
  expect_refused(judged, "/fields/x@tolerance");
  with([](Hdf5Writer& out) { out.attribute("/fields/x", "relative", std::nan("")); });
  expect_refused(judged, "/fields/x@relative");
  with([](Hdf5Writer& out) { out.vector("/condition/x", Eigen::VectorXd::Ones(4), ""); });
  expect_refused(judged, "/terms/x");
  with([](Hdf5Writer& out) { out.vector("/condition/y", Eigen::VectorXd::Ones(4), ""); });
  expect_refused(judged, "/condition/y");
  with([](Hdf5Writer& out) { out.integers("/terms/x", IdVector::Ones(4)); });
  expect_refused(judged, "/condition/x");
  with([](Hdf5Writer& out) {
    out.vector("/condition/x", Eigen::VectorXd::Constant(4, -1.0), "");
    out.attribute("/condition/x", "terms", 3);
  });
  expect_refused(judged, "/condition/x");
  with([](Hdf5Writer& out) { out.integers("/id", IdVector::Ones(4)); });
  expect_refused(judged, "/id");
  x_[1] = std::nan("");
  with([](Hdf5Writer& out) { out.attribute("/fields/x", "tolerance", 1.0); });
  expect_refused(judged, "/fields/x");
  reference([](Hdf5Writer&) {});
  expect_refused(judged, "/fields");
}

}  // namespace
}  // namespace decant
