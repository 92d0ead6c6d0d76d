/// \file
/// The fields in fp32 as ports legally write them: one evaluator, apart from reference/ and gpu/, whose
/// every step can be taken in several algebraically equal forms. oracle/tolerances.md says which forms are
/// legal; none may exceed a tolerance.
#pragma once

#include "oracle/solution/fixture.hpp"
#include "oracle/solution/tolerance.hpp"

#include <map>
#include <random>
#include <string>

namespace decant::test {

struct Forms {
  enum class Register { parts, gravity_first, gravity_last } accumulate = Register::parts;
  enum class Order { by_id, smallest_first, largest_first, random, pairwise } order = Order::by_id;
  enum class Root { root, square_times_inverse } root = Root::root;
  enum class Power { products, pow } power = Power::products;
  enum class Polynomial { horner, monomials, factored } polynomial = Polynomial::horner;
  enum class Frame { world, cell } frame = Frame::world;
  enum class Placing { translation, pivot, quaternion } placing = Placing::translation;
  enum class Velocity { world, local } velocity = Velocity::world;
  enum class Constant { rounded, formed } constants = Constant::rounded;
  enum class Image { of_difference, ghost } image = Image::of_difference;
  enum class Quotient { divided, by_inverse } quotient = Quotient::divided;  // r/h, rho/rho0, p/rho²
  enum class Factor { in_terms, after_sum } factor = Factor::in_terms;       // of viscosity and density
  bool fused = false;                                                        // sums by fused multiply-add
  bool flushed = false;                                                      // below 2⁻¹²⁶ is 0, where the host can
};

/// Every choice by its name: "order": "pairwise", …
std::map<std::string, std::string> choices(const Forms& forms);
Forms random_forms(std::mt19937& random);

/// Fields of a state by these forms, its neighbors as the oracle finds them.
/// \param given  as of Backend::evaluate
Fields evaluate_by(const Forms& forms, const Scene& scene, const Walls& walls, const ParticleState& state,
                   const StageInputs* given = nullptr);

/// A few hundred particles that no pour would show: lattices, exact and perturbed by any amount, and
/// clouds, free and in tanks at rest and tilting about pivots up to 20 m away, H = 2 to 4 dx, with velocities down to
/// the least that fp32 has.
Fixture random_form_case(std::uint32_t seed);

/// Largest |error| / tolerance of each real field.
std::map<std::string, double> scores(const Fields& got, const ReferenceSolution& oracle);

}  // namespace decant::test
