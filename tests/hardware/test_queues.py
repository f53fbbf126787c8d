from hypothesis import given
from hypothesis import strategies as st

from hardware.queues import EventQueue


def test_every_subscriber_gets_every_event_in_order():
    queue = EventQueue[int]()
    first, second = queue.subscribe(), queue.subscribe()
    for event in range(5):
        queue.put(event)
    assert first.take() == second.take() == [0, 1, 2, 3, 4]


def test_an_event_is_taken_once():
    queue = EventQueue[int]()
    subscription = queue.subscribe()
    queue.put(1)
    subscription.take()
    assert subscription.take() == []


def test_a_subscriber_gets_nothing_from_before():
    queue = EventQueue[int]()
    queue.put(1)
    assert queue.subscribe().take() == []
    assert queue.latest == 1


def test_an_ended_subscription_gets_nothing_more():
    queue = EventQueue[int]()
    subscription = queue.subscribe()
    queue.unsubscribe(subscription)
    queue.unsubscribe(subscription)
    queue.put(1)
    assert subscription.take() == []


def test_a_slow_reader_does_not_hurt_the_others():
    queue = EventQueue[int](capacity=2)
    slow, quick = queue.subscribe(), queue.subscribe()
    seen = []
    for event in range(5):
        queue.put(event)
        seen += quick.take()
    assert seen == [0, 1, 2, 3, 4]
    assert quick.dropped == 0
    assert slow.dropped == 3


@given(st.lists(st.integers(), max_size=50), st.integers(1, 10))
def test_a_full_queue_keeps_the_newest_and_counts_the_rest(events, capacity):
    queue = EventQueue[int](capacity)
    subscription = queue.subscribe()
    for event in events:
        queue.put(event)
    assert subscription.dropped == max(len(events) - capacity, 0)
    assert subscription.take() == events[-capacity:]
