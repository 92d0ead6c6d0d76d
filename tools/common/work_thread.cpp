/// \file
/// What is handed over, and the thread that takes it.
#include "tools/common/work_thread.hpp"

#include <utility>

namespace decant {

WorkThread::WorkThread() : thread_([this] { run(); }) {}

WorkThread::~WorkThread() {
  {
    std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void WorkThread::push(std::function<void()> work) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !busy_ || failure_; });
  if (failure_) std::rethrow_exception(failure_);
  next_ = std::move(work);
  busy_ = true;
  changed_.notify_all();
}

void WorkThread::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !busy_ || failure_; });
  if (failure_) std::rethrow_exception(failure_);
}

void WorkThread::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || next_; });
    if (stop_) return;
    std::function<void()> work = std::exchange(next_, nullptr);
    lock.unlock();
    std::exception_ptr failure;
    try {
      work();
    } catch (...) {
      failure = std::current_exception();
    }
    work = nullptr;  // and with it what it holds
    lock.lock();
    busy_ = false;
    failure_ = failure;
    changed_.notify_all();
    // A frame is missing from here on; writing later ones would hide it.
    if (failure_) return;
  }
}

}  // namespace decant
