/// \file
/// One piece of work beside the solver's loop, which never waits for it.
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <utility>

namespace decant::live {

class Background {
 public:
  bool idle() const { return !job_.valid() || job_.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }
  void wait() const {
    if (job_.valid()) job_.wait();
  }
  /// Only where idle. The work throws nothing.
  void start(std::function<void()> work) { job_ = std::async(std::launch::async, std::move(work)); }

 private:
  std::future<void> job_;  // its destructor waits
};

}  // namespace decant::live
