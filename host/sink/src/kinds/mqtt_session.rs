//! A connection to a broker: what was sent, what was acknowledged, and a new connection when it breaks.

use rumqttc::{Client, Connection, ConnectionError, Event, MqttOptions, Outgoing, Packet, QoS, RecvTimeoutError};
use std::collections::{HashMap, VecDeque};
use std::time::{Duration, Instant};

/// Requests that wait for the connection, so that it always has the next one.
const AHEAD: usize = 64;
/// Longest wait for the broker at the end.
const GOODBYE: Duration = Duration::from_millis(500);
/// How long the connection gets while there is nothing to send.
const LOOK: Duration = Duration::from_millis(2);

/// A message.
pub(super) struct Payload {
    /// Number of the record it stands for.
    pub(super) seq: u64,
    pub(super) topic: String,
    pub(super) retain: bool,
    pub(super) text: String,
}

/// What a connection is made with, or why that cannot be read.
pub(super) type Options = Box<dyn Fn() -> Result<MqttOptions, String> + Send>;

/// A session with a broker, open or not.
pub(super) struct Session {
    options: Options,
    /// Address and port of the connection that was tried last.
    broker: String,
    timeout: Duration,
    /// Topic that says whether this plant is there.
    state: String,
    open: Option<Open>,
    /// The last sending ended because the other side closed a connection that it had accepted.
    shut: bool,
}

struct Open {
    client: Client,
    connection: Connection,
    /// Numbers of what was handed to the connection and is not on its way, in order.
    handed: VecDeque<u64>,
    /// Numbers of what is on its way, by packet.
    sent: HashMap<u16, u64>,
}

impl Session {
    pub(super) fn new(options: Options, timeout: Duration, state: String) -> Self {
        Self { options, broker: String::new(), timeout, state, open: None, shut: false }
    }

    pub(super) fn was_shut(&self) -> bool {
        self.shut
    }

    pub(super) fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// Sends messages; the number of the last record up to which all are acknowledged. After an error the connection is
    /// closed.
    pub(super) fn send(&mut self, messages: Vec<Payload>) -> Result<u64, String> {
        let last = messages.last().map_or(0, |m| m.seq);
        let mut first_open = messages.first().map_or(0, |m| m.seq);
        self.shut = false;
        self.connect()?;
        let numbers: Vec<u64> = messages.iter().map(|m| m.seq).collect();
        let mut messages = messages.into_iter().peekable();
        let mut heard = Instant::now();
        let failure = loop {
            let Some(open) = &mut self.open else { break "the connection is closed".to_owned() };
            while open.handed.len() < AHEAD
                && let Some(message) = messages.next()
            {
                open.publish(message);
            }
            if messages.peek().is_none() && open.all_acknowledged() {
                return Ok(last);
            }
            match open.turn(Duration::from_millis(250)) {
                Ok(Some(acknowledged)) => {
                    heard = if acknowledged { Instant::now() } else { heard };
                    first_open = open.oldest().or_else(|| messages.peek().map(|m| m.seq)).unwrap_or(first_open);
                }
                Ok(None) if heard.elapsed() > self.timeout => break "the broker acknowledges nothing".to_owned(),
                Ok(None) => {}
                Err(why) => {
                    self.shut = true;
                    break why;
                }
            }
        };
        self.open = None;
        // What is before the oldest message without its acknowledgement has arrived.
        match numbers.into_iter().take_while(|seq| *seq < first_open).last() {
            Some(seq) => Ok(seq),
            None => Err(self.of_broker(&failure)),
        }
    }

    /// Keeps the connection alive, or tries to open it.
    pub(super) fn attend(&mut self) -> Result<(), String> {
        self.connect()?;
        let Some(open) = &mut self.open else { return Ok(()) };
        loop {
            match open.turn(LOOK) {
                Ok(Some(_)) => {}
                Ok(None) => return Ok(()),
                Err(why) => {
                    self.open = None;
                    return Err(self.of_broker(&why));
                }
            }
        }
    }

    /// Takes leave, so that the broker need not publish the last will: says itself that this plant is gone.
    pub(super) fn say_goodbye(&mut self) {
        let Some(open) = &mut self.open else { return };
        open.publish(Payload { seq: 0, topic: self.state.clone(), retain: true, text: "offline".into() });
        let end = Instant::now() + GOODBYE;
        while !open.all_acknowledged() && Instant::now() < end {
            if open.turn(end.saturating_duration_since(Instant::now())).is_err() {
                return;
            }
        }
        // Without it the broker publishes the last will, which says the same.
        let _ = open.client.try_disconnect();
        while Instant::now() < end {
            match open.connection.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(Ok(Event::Outgoing(Outgoing::Disconnect))) | Err(_) | Ok(Err(_)) => return,
                Ok(Ok(_)) => {}
            }
        }
    }

    /// Opens the connection, if it is closed, and says that this plant is there.
    fn connect(&mut self) -> Result<(), String> {
        if self.open.is_some() {
            return Ok(());
        }
        let options = (self.options)()?;
        let (address, port) = options.broker_address();
        self.broker = format!("{address}:{port}");
        let (client, mut connection) = Client::new(options, 2 * AHEAD);
        connection.eventloop.network_options.set_connection_timeout(self.timeout.as_secs().max(1));
        let mut open = Open { client, connection, handed: VecDeque::new(), sent: HashMap::new() };
        // The first event is the answer to the connection, or why there is none; its time is bounded by the option above.
        match open.connection.recv() {
            Ok(Ok(Event::Incoming(Packet::ConnAck(_)))) => {}
            Ok(Ok(event)) => return Err(self.of_broker(&format!("an unexpected answer, {event:?}"))),
            Ok(Err(error)) => return Err(self.of_broker(&sentence(&error))),
            Err(_) => return Err(self.of_broker("the connection is closed")),
        }
        open.publish(Payload { seq: 0, topic: self.state.clone(), retain: true, text: "online".into() });
        self.open = Some(open);
        Ok(())
    }

    fn of_broker(&self, why: &str) -> String {
        format!("the broker {} takes nothing: {why}", self.broker)
    }
}

impl Open {
    fn publish(&mut self, message: Payload) {
        let Payload { seq, topic, retain, text } = message;
        // There is room for twice as many as are handed over, and topics have no wildcards. Were it refused all the same, it
        // would count as handed and never be acknowledged: the connection is closed and all comes again.
        let _ = self.client.try_publish(topic, QoS::AtLeastOnce, retain, text);
        self.handed.push_back(seq);
    }

    fn all_acknowledged(&self) -> bool {
        self.handed.is_empty() && self.sent.is_empty()
    }

    /// The oldest record of which a message is not acknowledged.
    fn oldest(&self) -> Option<u64> {
        // The one that says that this plant is there has number 0, and stands for no record.
        self.sent.values().chain(&self.handed).copied().filter(|seq| *seq > 0).min()
    }

    /// One event; whether it was an acknowledgement. `None` when there was none in time. An error says why, for a person.
    fn turn(&mut self, timeout: Duration) -> Result<Option<bool>, String> {
        match self.connection.recv_timeout(timeout) {
            Ok(Ok(Event::Outgoing(Outgoing::Publish(packet)))) => {
                if let Some(seq) = self.handed.pop_front() {
                    self.sent.insert(packet, seq);
                }
                Ok(Some(false))
            }
            Ok(Ok(Event::Incoming(Packet::PubAck(ack)))) => {
                self.sent.remove(&ack.pkid);
                Ok(Some(true))
            }
            Ok(Ok(_)) => Ok(Some(false)),
            Ok(Err(error)) => Err(sentence(&error)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err("the connection is closed".into()),
        }
    }
}

/// Why, in words for a person.
fn sentence(error: &ConnectionError) -> String {
    use rumqttc::{ConnectReturnCode as Code, StateError};
    match error {
        ConnectionError::NetworkTimeout | ConnectionError::FlushTimeout => "no answer in time".into(),
        ConnectionError::Io(error) => error.to_string(),
        ConnectionError::MqttState(StateError::Io(error)) => error.to_string(),
        ConnectionError::MqttState(StateError::ConnectionAborted) => "it has closed the connection".into(),
        ConnectionError::MqttState(StateError::AwaitPingResp) => "it gives no sign of life".into(),
        ConnectionError::ConnectionRefused(Code::BadUserNamePassword | Code::NotAuthorized) => {
            "it knows no such user, or the password is wrong; see `username` and `password-file`".into()
        }
        ConnectionError::ConnectionRefused(code) => format!("it refuses the connection ({code:?})"),
        other => other.to_string(),
    }
}
