// A part of the page that is rendered again only when its properties or the language change: the page is rendered twice a second, and
// a table of thousands of rows takes longer than that, in which time not even ABORT would answer.

import { Component, h, type FunctionComponent } from "preact";

export function steady<P extends object>(Part: FunctionComponent<P>) {
  return class extends Component<P> {
    override shouldComponentUpdate(next: Readonly<P>): boolean {
      const now: Readonly<P> = this.props;
      return (Object.keys(next) as (keyof P)[]).some((name) => next[name] !== now[name]);
    }
    override render() {
      return h(Part, this.props);
    }
  };
}
