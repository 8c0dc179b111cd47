// actq.h for C++17 and later: spans and references, no exceptions, no allocation. An image and its head belong to one
// object, which frees nothing: all memory is the caller's.
//
// SPDX-License-Identifier: MIT OR Apache-2.0
#ifndef ACTQ_HPP
#define ACTQ_HPP

#include "actq.h"

static_assert(ACTQ_ABI == 3, "actq.h and actq.hpp are of different versions");

namespace actq {

// Values that follow each other in memory: as std::span of C++20, which microcontrollers' toolchains often lack. It
// takes arrays, and containers with data() and size().
template <typename T>
class span {
public:
    constexpr span() noexcept = default;
    constexpr span(T *data, size_t size) noexcept : data_(data), size_(size) {}
    template <size_t N>
    constexpr span(T (&array)[N]) noexcept : data_(array), size_(N) {}
    template <typename C, typename = decltype(static_cast<C *>(nullptr)->data())>
    constexpr span(C &container) noexcept : data_(container.data()), size_(container.size()) {}
    template <typename C, typename = decltype(static_cast<const C *>(nullptr)->data())>
    constexpr span(const C &container) noexcept : data_(container.data()), size_(container.size()) {}
    constexpr T *data() const noexcept { return data_; }
    constexpr size_t size() const noexcept { return size_; }

private:
    T *data_ = nullptr;
    size_t size_ = 0;
};

// The outcome of a call: true if it is done.
class [[nodiscard]] Status {
public:
    constexpr Status(actq_status code) noexcept : code_(code) {}
    constexpr explicit operator bool() const noexcept { return code_ == ACTQ_OK; }
    constexpr bool pending() const noexcept { return code_ == ACTQ_PENDING; }
    constexpr actq_status code() const noexcept { return code_; }
    const char *text() const noexcept { return actq_status_text(code_); }

private:
    actq_status code_;
};

// An image and a head that runs it. Every function is the one of actq.h with the same name. Before open has succeeded
// they return ACTQ_NOT_INITIALIZED.
class Head {
public:
    Head() noexcept = default;
    // The scratch memory belongs to one head, at one address.
    Head(const Head &) = delete;
    Head &operator=(const Head &) = delete;

    // Opens the image, which must stay where it is, and initializes the head in scratch, which belongs to it.
    Status open(span<const uint32_t> image, span<uint32_t> scratch) noexcept {
        return open_with(actq_image_open, image, scratch);
    }
    // The same for an image that `actq export-c` wrote into the program.
    Status open_checksummed(span<const uint32_t> image, span<uint32_t> scratch) noexcept {
        return open_with(actq_image_open_checksummed, image, scratch);
    }

    Status reset() noexcept { return actq_reset(&head_); }
    Status seed(uint32_t seed) noexcept { return actq_seed(&head_, seed); }
    Status self_test() noexcept { return actq_self_test(&head_); }
    Status pass(size_t periods) noexcept { return actq_pass(&head_, periods); }

    Status step(span<const float> observation, span<float> action) noexcept {
        return actq_step(&head_, observation.data(), observation.size(), action.data(), action.size());
    }
    Status begin(span<const float> observation) noexcept {
        return actq_begin(&head_, observation.data(), observation.size());
    }
    Status least_budget(uint32_t &budget) noexcept { return actq_least_budget(&head_, &budget); }
    Status poll(uint32_t budget, span<float> action) noexcept {
        return actq_poll(&head_, budget, action.data(), action.size());
    }
    Status play(span<float> action) noexcept { return actq_play(&head_, action.data(), action.size()); }

    Status set_input(const char *name, span<const float> values, span<float> observation) const noexcept {
        return actq_set_input(
            &image_, name, values.data(), values.size(), observation.data(), observation.size());
    }

    Status prefix_bytes(size_t &bytes) noexcept { return actq_prefix_bytes(&head_, &bytes); }
    Status set_prefix(span<const uint8_t> from) noexcept {
        return actq_set_prefix(&head_, from.data(), from.size());
    }
    Status clear_prefix() noexcept { return actq_clear_prefix(&head_); }

    Status saved_bytes(size_t &bytes) noexcept { return actq_saved_bytes(&head_, &bytes); }
    Status save(span<uint8_t> to) noexcept { return actq_save(&head_, to.data(), to.size()); }
    Status restore(span<const uint8_t> from) noexcept {
        return actq_restore(&head_, from.data(), from.size());
    }

    Status sizes(actq_sizes &sizes) const noexcept { return actq_image_sizes(&image_, &sizes); }
    Status cost(actq_cost &cost) const noexcept { return actq_image_cost(&image_, &cost); }
    Status name(actq_text &name) const noexcept { return actq_image_name(&image_, &name); }
    Status port(size_t number, actq_port &port) const noexcept {
        return actq_image_port(&image_, number, &port);
    }

private:
    using Open = actq_status(actq_image *, const uint8_t *, size_t);
    Status open_with(Open &open, span<const uint32_t> image, span<uint32_t> scratch) noexcept {
        if (actq_abi() != ACTQ_ABI) {
            return ACTQ_ABI_DIFFERS;
        }
        const auto *bytes = reinterpret_cast<const uint8_t *>(image.data());
        head_ = actq_head{};
        const actq_status opened = open(&image_, bytes, 4 * image.size());
        return opened != ACTQ_OK ? opened : actq_head_init(&head_, &image_, scratch.data(), scratch.size());
    }

    actq_image image_{};
    actq_head head_{};
};

}  // namespace actq

#endif
