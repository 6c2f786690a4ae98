// Which instruction set runs, and on how many threads.
#pragma once

#include <exception>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "kernels.hpp"

namespace kinverse {

// the instruction sets this processor has, narrowest first
std::vector<const Kernels*> available_kernels();
const Kernels& active_kernels();
// For the iterations of a pose or two: four lanes finish them sooner than eight, which cost more a step
// and mostly run starts that are not needed. Both have fused multiply-adds, so the bits are the same.
const Kernels& latency_kernels();
void set_active_kernels(const std::string& name);

int thread_count();
void set_thread_count(int count);

// How many parts `count` pieces of work are split into: one a thread, none smaller than least_part.
// Asked once a call, so that another thread that changes the number changes nothing under way.
long parts_of(long count, long least_part);

// work(first, last, part) on contiguous parts of [0, count), numbered in order. A part whose thread
// cannot be made runs on the caller's; the first exception of any part is thrown at the end.
template <class Work>
void run_parts(long count, long parts, Work work) {
  std::vector<std::exception_ptr> errors(static_cast<size_t>(parts));
  auto guarded = [&](long part) {
    try {
      work(count * part / parts, count * (part + 1) / parts, part);
    } catch (...) {
      errors[static_cast<size_t>(part)] = std::current_exception();
    }
  };
  std::vector<std::thread> threads;
  threads.reserve(static_cast<size_t>(parts));
  long started = 1;
  try {
    for (; started < parts; ++started) threads.emplace_back(guarded, started);
  } catch (const std::system_error&) {
    for (long part = started; part < parts; ++part) guarded(part);
  }
  guarded(0);
  for (auto& thread : threads) thread.join();
  for (const auto& error : errors)
    if (error) std::rethrow_exception(error);
}

template <class Work>
void split_over_threads(long count, long least_part, Work work) {
  run_parts(count, parts_of(count, least_part), work);
}

}  // namespace kinverse
