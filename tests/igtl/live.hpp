// A scene that is served to OpenIGTLink's own client, in the same process. Limits of time decide nothing but how long a test waits before
// it fails.
#pragma once

#ifdef TROCAR_OPENIGTLINK

#include "../engine/step_fixture.hpp"

#include "engine/igtl/bridge.hpp"
#include "engine/time/clock.hpp"
#include "engine/viewer/server.hpp"

#include <igtlClientSocket.h>
#include <igtlMath.h>
#include <igtlMessageHeader.h>
#include <igtlPolyDataMessage.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>
#include <nlohmann/json.hpp>

#include <csignal>
#include <functional>
#include <mutex>
#include <thread>

namespace trocar::engine::igtl::test {

inline constexpr std::int64_t kPatienceNs = 60'000'000'000; // far more than anything takes, also on a busy machine
inline constexpr int kPatienceMs = 60'000;

/// False: it was not so in time.
template <class Good>
bool await(Good&& good) {
    for (const std::int64_t end = monotonic_ns() + kPatienceNs; !good() && monotonic_ns() < end;) std::this_thread::yield();
    return good();
}

/// A wire in a bent tube, without a page, until it goes out of scope.
struct Live {
    Scene scene;
    PreparedScene prepared;
    std::optional<viewer::Session> session;
    viewer::Exchange exchange;
    std::unique_ptr<viewer::Server> server;
    unsigned short port = 0;
    RunStatistics tally;
    viewer::LoopOptions options;
    std::thread thread;
    std::mutex guard;
    std::vector<std::string> said_; // by the bridge

    /// runs  at once; else the session goes on where run() says so
    explicit Live(const std::string& text = engine::test::bent_tube_scene({35, "work:20000"}), double rate = 60.0, bool runs = true) {
        auto read = parse_scene(text, "scenes/live.json");
        EXPECT_TRUE(read.ok()) << (read.ok() ? "" : read.error().to_string());
        scene = std::move(*read);
        prepared = *make_prepared_scene(scene);
        session.emplace(scene, prepared);
        open_exchange(*session, exchange);
        BridgeOptions bridge;
        bridge.rate = rate;
        bridge.say = [this](const std::string& sentence) {
            const std::lock_guard<std::mutex> lock(guard);
            said_.push_back(sentence);
        };
        bridge.listens = [this](unsigned short at) { port = at; };
        viewer::ServerOptions serves;
        serves.serves_page = false;
        serves.beside = [this, bridge](viewer::Hub& hub) { return Bridge::open(hub, prepared.model, bridge); };
        auto opened = viewer::Server::open(scene, prepared, *session, exchange, serves);
        EXPECT_TRUE(opened.ok()) << (opened.ok() ? "" : opened.error().to_string());
        server = std::move(*opened);
        if (runs) thread = std::thread([this] { run_loop(*session, exchange, options, tally); });
    }
    void run(std::uint64_t steps) { run_loop(*session, exchange, {steps, false}, tally); }
    /// The simulation ends, and with it the clients; the session stays.
    void stop() {
        exchange.stop = true;
        if (thread.joinable()) thread.join();
        server.reset();
    }
    std::vector<std::string> said() {
        const std::lock_guard<std::mutex> lock(guard);
        return said_;
    }
    ~Live() { stop(); }
};

/// A message as it came.
struct Message {
    std::string type, name;
    std::vector<char> bytes; // header and body
    double time_s = 0.0;
};

/// The library's own client. Reads when asked to.
class Client {
public:
    explicit Client(const Live& live) : socket_(::igtl::ClientSocket::New()) {
        std::signal(SIGPIPE, SIG_IGN); // a connection that the server ended is no reason to die
        EXPECT_EQ(socket_->ConnectToServer("127.0.0.1", live.port), 0);
        socket_->SetReceiveTimeout(kPatienceMs);
    }
    ~Client() { close(); }
    void close() { socket_->CloseSocket(); }

    bool send(const void* bytes, std::size_t size) { return socket_->Send(bytes, static_cast<int>(size)) != 0; }
    bool send(const std::string& bytes) { return send(bytes.data(), bytes.size()); }
    void say(const std::string& text) {
        const auto message = ::igtl::StringMessage::New();
        message->SetDeviceName("trocar_command");
        message->SetString(text.c_str());
        message->Pack();
        EXPECT_TRUE(send(message->GetPackPointer(), static_cast<std::size_t>(message->GetPackSize())));
    }
    void drive_to(double mm, double angle, const char* device = "wire_drive") {
        ::igtl::Matrix4x4 m;
        ::igtl::IdentityMatrix(m);
        m[0][0] = m[1][1] = static_cast<float>(std::cos(angle));
        m[1][0] = static_cast<float>(std::sin(angle));
        m[0][1] = -m[1][0];
        m[2][3] = static_cast<float>(mm);
        const auto message = ::igtl::TransformMessage::New();
        message->SetDeviceName(device);
        message->SetMatrix(m);
        message->Pack();
        EXPECT_TRUE(send(message->GetPackPointer(), static_cast<std::size_t>(message->GetPackSize())));
    }

    /// The next message; nothing: the connection ended, or none came.
    std::optional<Message> read() {
        const auto header = ::igtl::MessageHeader::New();
        header->InitPack();
        if (socket_->Receive(header->GetPackPointer(), header->GetPackSize()) != header->GetPackSize()) return std::nullopt;
        const char* begin = static_cast<const char*>(header->GetPackPointer());
        Message message{.type = {}, .name = {}, .bytes = {begin, begin + header->GetPackSize()}};
        header->Unpack();
        message.type = header->GetDeviceType();
        message.name = header->GetDeviceName();
        unsigned int seconds = 0, fraction = 0;
        header->GetTimeStamp(&seconds, &fraction);
        message.time_s = seconds + fraction / 4294967296.0;
        const auto size = static_cast<std::size_t>(header->GetBodySizeToRead());
        message.bytes.resize(message.bytes.size() + size);
        if (size > 0 && socket_->Receive(message.bytes.data() + kHeaderSize, static_cast<int>(size)) != static_cast<int>(size)) return std::nullopt;
        return message;
    }
    /// Reads on to a message that `good` accepts.
    std::optional<Message> await(const std::function<bool(const Message&)>& good) {
        for (const std::int64_t end = monotonic_ns() + kPatienceNs; monotonic_ns() < end;) {
            auto message = read();
            if (!message || good(*message)) return message;
        }
        return std::nullopt;
    }
    std::optional<Message> await(const std::string& type, const std::string& name) {
        return await([&](const Message& message) { return message.type == type && message.name == name; });
    }
    /// The state that `good` accepts; null: none came.
    nlohmann::json await_state(const std::function<bool(const nlohmann::json&)>& good);
    /// Text of a STATUS with this code.
    std::string await_status(int code);

private:
    ::igtl::ClientSocket::Pointer socket_;
};

/// By the library, its checksum tested. Null: it does not take it.
template <class M>
typename M::Pointer unpack(const Message& message) {
    const auto header = ::igtl::MessageHeader::New();
    header->InitPack();
    std::copy_n(message.bytes.data(), kHeaderSize, static_cast<char*>(header->GetPackPointer()));
    header->Unpack();
    auto unpacked = M::New();
    unpacked->SetMessageHeader(header);
    unpacked->AllocatePack();
    std::copy(message.bytes.begin() + kHeaderSize, message.bytes.end(), static_cast<char*>(unpacked->GetPackBodyPointer()));
    if ((unpacked->Unpack(1) & ::igtl::MessageHeader::UNPACK_BODY) == 0) return nullptr;
    return unpacked;
}

inline nlohmann::json Client::await_state(const std::function<bool(const nlohmann::json&)>& good) {
    nlohmann::json state;
    const auto message = await([&](const Message& one) {
        if (one.type != "STRING" || one.name != "trocar_state") return false;
        state = nlohmann::json::parse(unpack<::igtl::StringMessage>(one)->GetString());
        return good(state);
    });
    return message ? state : nlohmann::json();
}

inline std::string Client::await_status(int code) {
    std::string text;
    (void)await([&](const Message& one) {
        if (one.type != "STATUS") return false;
        const auto status = unpack<::igtl::StatusMessage>(one);
        text = status->GetStatusString();
        return status->GetCode() == code;
    });
    return text;
}

} // namespace trocar::engine::igtl::test

#endif
