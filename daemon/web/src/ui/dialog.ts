// A dialog that is not modal: the abort button stays accessible. Escape leaves it; the keyboard's focus stays in it and on that button,
// since the page behind it is covered, and returns to where it was.

import { useLayoutEffect, useRef } from "preact/hooks";
import type { RefObject } from "preact";

const CONTROLS = ":is(button, input, select):enabled, summary, a[href]";

/** Shown before the next paint, so that Escape works as soon as it is visible. */
export function useDialog(leave: () => void): RefObject<HTMLDialogElement> {
  const dialog = useRef<HTMLDialogElement>(null);
  const leave_now = useRef(leave);
  leave_now.current = leave;
  useLayoutEffect(() => {
    const before = document.activeElement;
    const within = (place: EventTarget | null) => place instanceof Node && dialog.current?.contains(place);
    dialog.current?.show();
    const pressed = (event: KeyboardEvent) => event.key === "Escape" && leave_now.current();
    const focused = ({ target, relatedTarget }: FocusEvent) => {
      const abort = document.getElementById("abort-button");
      if (within(target) || target === abort) return;
      const first = within(relatedTarget) ? null : dialog.current?.querySelector<HTMLElement>(CONTROLS);
      (first ?? abort)?.focus();
    };
    addEventListener("keydown", pressed);
    addEventListener("focusin", focused);
    return () => {
      removeEventListener("keydown", pressed);
      removeEventListener("focusin", focused);
      if (before instanceof HTMLElement) before.focus();
    };
  }, []);
  return dialog;
}
