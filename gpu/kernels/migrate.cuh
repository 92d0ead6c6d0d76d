/// \file
/// How particles come to the ranks that need them: each goes to the rank in whose box it is, which owns it from then
/// on, and as a ghost to every rank whose box is within reach. Decided once per particle, by its owner before, and
/// told to all: two ranks that computed it apart could round apart.
///
/// Ids of a rank count its particles in the order of the problem's ids. So cells and lists, which order by id, order
/// alike on any number of ranks, and so do the lists of what two ranks exchange.
#pragma once

#include "gpu/core/teams.cuh"
#include "gpu/physics/vectors.cuh"

namespace decant::gpu {
namespace {

/// Who needs a particle.
struct alignas(16) Registration {
  unsigned long long ghost_on;  // bit k: rank k
  int owner;
  int id;  // the problem's
};

/// A particle on its way to another rank.
struct Traveller {
  float4 position, velocity;
  Registration registration;
};

/// The ranks' boxes: what each owns, and what it needs ghosts of.
struct RankBoxes {
  int rank, ranks;
  const Box *own, *reach;

  DECANT_DEVICE bool are_of(int any) const { return any >= 0 && any < ranks; }
};

struct AssignRanks {
  Constants c;
  ParticleArrays a;
  RankBoxes boxes;
  Registration* registrations;
  int* stays;      // 1: owned here from now on, or a ghost here
  int* departing;  // by rank, how many go there

  DECANT_DEVICE void operator()(int i) const {
    Registration to{0, -1, a.problem_id(a.id[i])};
    if (!a.is_ghost(i)) assign(xyz(a.state.position[i]), to);
    registrations[i] = to;
    stays[i] = needed_by(to, boxes.rank);
    for (int r = 0; r < boxes.ranks; ++r)
      if (r != boxes.rank && needed_by(to, r)) atomic_increment(departing + r);
  }

  DECANT_DEVICE static bool needed_by(const Registration& particle, int rank) {
    return particle.owner == rank || (particle.ghost_on >> rank & 1) != 0;
  }

 private:
  DECANT_DEVICE void assign(Float3 x, Registration& to) const {
    to.owner = 0;  // of what is nowhere
    if (!is_finite(x)) return;
    x = {into_domain(0, x.x), into_domain(1, x.y), into_domain(2, x.z)};
    for (int r = 0; r < boxes.ranks; ++r)
      if (boxes.own[r].holds(x)) to.owner = r;
    for (int r = 0; r < boxes.ranks; ++r) {
      const Box& reach = boxes.reach[r];
      if (r != to.owner && within(0, reach.min.x, reach.max.x, x.x) && within(1, reach.min.y, reach.max.y, x.y) &&
          within(2, reach.min.z, reach.max.z, x.z))
        to.ghost_on |= 1ull << r;
    }
  }
  DECANT_DEVICE float into_domain(int axis, float x) const {
    const float periods = floorf((x - c.domain_min[axis]) * c.inverse_period[axis]);
    return c.periodic[axis] ? x - c.period[axis] * periods : x;
  }
  /// By the nearest image.
  DECANT_DEVICE bool within(int axis, float low, float high, float x) const {
    const auto between = [&](float at) { return at >= low && at <= high; };
    return between(x) || (c.periodic[axis] && (between(x + c.period[axis]) || between(x - c.period[axis])));
  }
};
DECANT_KERNEL(256) assign_ranks_kernel(int n, AssignRanks assign) { for_each_thread(n, assign); }

/// What stays goes to the front of the spare arrays, in the order that it had; all else to its ranks' travellers.
struct Depart {
  ParticleArrays a;
  RankBoxes boxes;
  const Registration* registrations;
  const int *stays, *place;  // place: how many stay before it
  const int* first;          // by rank, where its travellers begin
  int* gone;                 // by rank
  Registration* stayed;
  Traveller* travellers;

  DECANT_DEVICE void operator()(int i) const {
    const Registration to = registrations[i];
    const float4 position = a.state.position[i], velocity = a.state.velocity[i];
    if (stays[i]) {
      a.spare.position[place[i]] = position;
      a.spare.velocity[place[i]] = velocity;
      stayed[place[i]] = to;
    }
    for (int r = 0; r < boxes.ranks; ++r)
      if (r != boxes.rank && AssignRanks::needed_by(to, r))
        travellers[first[r] + atomic_increment(gone + r)] = {position, velocity, to};
  }
};
DECANT_KERNEL(256) depart_kernel(int n, Depart depart) { for_each_thread(n, depart); }

struct Arrive {
  ParticleArrays a;
  const Traveller* travellers;
  int first;
  Registration* registrations;

  DECANT_DEVICE void operator()(int k) const {
    const Traveller& t = travellers[k];
    a.spare.position[first + k] = t.position;
    a.spare.velocity[first + k] = t.velocity;
    registrations[first + k] = t.registration;
  }
};
DECANT_KERNEL(256) arrive_kernel(int n, Arrive arrive) { for_each_thread(n, arrive); }

/// How many particles a rank exchanges with each other one in a substep, and how many have copies anywhere; and
/// keys for the sort by the problem's ids, with what they belong to.
struct CountExchanged {
  RankBoxes boxes;
  const Registration* registrations;
  int *sends, *receives;  // by rank
  int* border;
  int* damaged;  // particles with what nobody wrote
  int *key, *index;

  DECANT_DEVICE void operator()(int i) const {
    const Registration r = registrations[i];
    key[i] = r.id;
    index[i] = i;
    if (!boxes.are_of(r.owner)) atomic_increment(damaged);
    else if (r.owner != boxes.rank) atomic_increment(receives + r.owner);
    else if (r.ghost_on != 0) {
      atomic_increment(border);
      for (int to = 0; to < boxes.ranks; ++to)
        if (r.ghost_on >> to & 1) atomic_increment(sends + to);
    }
  }
};
DECANT_KERNEL(256) count_exchanged_kernel(int n, CountExchanged count) { for_each_thread(n, count); }

/// After the sort: ids of this rank, and the lists of what is exchanged, rank by rank; they are sorted afterwards.
struct NumberById {
  ParticleArrays a;
  RankBoxes boxes;
  const Registration* registrations;
  const int *key, *at;
  int* global_id;
  ParticleRole* role;
  const int *first_send, *first_receive;  // by rank, where its entries begin
  int *sent, *received;                   // by rank, how many are there
  int *send, *receive;
  int *bordering, *border;  // how many are there; ids in any order
  int* doubled;             // ids that came twice

  DECANT_DEVICE void operator()(int k) const {
    const int i = at[k];
    const Registration r = registrations[i];
    a.id[i] = k;
    a.index[k] = i;
    global_id[k] = key[k];
    role[k] = r.owner != boxes.rank ? ParticleRole::ghost
              : r.ghost_on != 0     ? ParticleRole::border
                                    : ParticleRole::interior;
    if (k > 0 && key[k] == key[k - 1]) atomic_increment(doubled);
    if (r.owner != boxes.rank) {
      receive[first_receive[r.owner] + atomic_increment(received + r.owner)] = k;
      return;
    }
    if (r.ghost_on == 0) return;
    border[atomic_increment(bordering)] = k;
    for (int to = 0; to < boxes.ranks; ++to)
      if (r.ghost_on >> to & 1) send[first_send[to] + atomic_increment(sent + to)] = k;
  }
};
DECANT_KERNEL(256) number_by_id_kernel(int n, NumberById number) { for_each_thread(n, number); }

/// Of the particles that a rank owns: samples of where they are, and how fast the fastest is. Which are samples is
/// told by their ids, so that all ranks together take the same ones however they share the particles.
struct Survey {
  ParticleArrays a;
  int every;  // id
  int room;   // for samples
  float4* position;
  int *id, *samples;
  int* fastest;  // |v|², float bits

  DECANT_DEVICE void operator()(int i) const {
    if (a.is_ghost(i)) return;
    const Float3 v = xyz(a.state.velocity[i]);
    const float square = dot(v, v), bounded = square <= 3.0e38f ? square : 0.0f;  // what is nowhere ends the run
    raise_to(fastest, bounded);
    const int own = a.problem_id(a.id[i]);
    if (own % every != 0) return;
    const int k = atomic_increment(samples);
    if (k >= room) return;
    position[k] = a.state.position[i];
    id[k] = own;
  }
};
DECANT_KERNEL(256) survey_kernel(int n, Survey survey) { for_each_thread(n, survey); }

}  // namespace
}  // namespace decant::gpu
