"""The words of docs/blind.md; `blind_page` puts tables and counts in."""

# What the study could not do for want of time, to be said by hand.
AFFORDED = """a third of all sets, and of those with something hidden, at the size of a campaign: a truth there
takes one to three minutes of a core. Of pairs, of bad readings and of own equations there are few sets to judge by.

This is the fifth edition. It was made larger three times: 608 sets with one code, 170 with a later one that decides
the same, and 170 more, sized in the truth. What was chosen after seeing some of these sets, which are no proof of it:

- Of the first 207, twelve objects were looked at one by one, the weakest line then: none of these in 6, a place within
  1.5 m in 4. Places were changed after them: drag may push, objects may be as large as piers and scour holes, a place
  is looked for between the spots. Five more were looked at when a place was spread over where it may lie, and the bad
  reading beside a floor level error when rules for a place beside a listed effect were changed. Lines of objects that
  were not looked at leave these seventeen out.
- Of 113 sets added then, seven in which a place led the effect that was named were looked at. Since then the verdict
  begins with such a place, `extend --auto` tries it too, and a step counts as true where the place that is told first
  is. Those seven were made anew. What is told first is proved by the 90 objects added after, and those since.
- After one of these 90, no place is kept any more that acts mostly where nobody measured. 68 of those kept were looked
  through for it, and that was the only one.
- No instrument with negative evidence is set aside, and a place may lead another by 3 to 1. The 72 sets that these two
  rules could change were diagnosed again: 22 lost an instrument, which none of them had, and four objects and one
  listed effect of ratio 3 are told as none of these. One of the four was seen when the second rule was chosen.
- What is not excluded is listed for an effect of two to four standard errors, and not of three. That was chosen after
  54 sets of ratio 3, in which the list held the effect in 40 and now in 49; in 20 such sets that were kept back it held
  12 and now 15. Lists of all sets of ratio 3, and of those of ratio 6 where nothing is named, were made anew, but for
  one whose truth was not found again.
- Of a probe that is set aside a factor is free, too. The 40 sets with an instrument or a bad reading were diagnosed
  again: verdicts, names and instruments are the same in all.
- After this edition errors were mended that a review of the code found: effects of one sign were never dropped again,
  water beside the sides of a flume answered wrongly, and others that CHANGELOG names. No set was made anew for them.
- The 100 sets of the small channel with nothing hidden and small imperfections, and fifteen with an instrument, were
  made anew on 2026-11-27, after the correlation of errors, the flow at both ends, answers beside inflows and what
  CHANGELOG names since were mended. In 97 and 14 verdict, names and numbers of places and instruments are the same. One
  more set with nothing hidden has a place named, and one less an instrument; one set lost a false effect beside its
  gauge, and is told as "cannot tell".
- Since then effects are looked at from other places, early effects compete again with everything, and an inflow may be
  skewed by 40 %. Chosen after three [drawn sites](diagnosis.md), tried on eight others. The 100 sets of the small
  channel with nothing hidden and small imperfections, and all 36 of the stranger with an instrument or, in that
  channel, a bad probe were made anew: two of the former that named an effect cannot tell now, and in all others
  the verdict is the same.
- Since then Smagorinsky's length is kept on other cells, and effects compete again once an instrument is set aside.
  After the first of these the 28 sets 124 to 151 of the small channel with something unlisted were made anew, as many
  as the time allowed. In 24 the verdict is of the same kind. Two that named a known effect say none of these now; of
  two that said it one names a known effect, and one cannot tell. One hole is placed 3 m further off.
- Since then all places together have to lead all that is known by 5 to 1; up to 10 to 1, or beside another place, it
  was "cannot tell". Chosen after what the 62 undecided sets were told. The 28 sets that it could change were diagnosed
  again: nine objects more are told as none of these, eight of them within 1.5 m, and two are no longer. Lines of what
  was not looked at leave these eleven out. Thirty objects more were hidden for it then, numbers 184 to 213, which
  nobody had seen: none of these in 21, a place within 1.5 m in 14. Drag of the banks that grows along the channel was
  listed as well (`bank_drag_trend`): eleven sets with an effect of the banks, diagnosed again, have verdicts of the
  same kind.
- Since then all that something unlisted leaves in its surroundings holds half of it, and not half in each of some 40
  bumps. The first 125 objects of the small channel were hidden anew for it, all sized in the stranger's own flow:
  none of these is told of 84 and a place within 1.5 m of 52 (42 %); of the same objects in the lines below, of other
  sizes, of 84 and 55. What `extend --auto` kept lowered the error in 65 of 87, there in 61 of 81. No site of this
  study has a patch whose sides lie within cells, see DECISIONS: nothing here tells of that.

On what nobody had looked at it is right less often than on what it was chosen after. What `extend --auto` keeps is
counted as it was before the last changes of its rule in all but the last 170: in 42 sets all that was named was
refused, and 30 of them would have been better with it. Of fourteen that were run again with a later rule, eight keep
it, six of them better and two worse.

The fourth edition, of 202 sets, is dropped: on imperfect sites with nothing hidden something was named in 18 of 82.
Errors of the sides of patches were not told as they act (see `site_error`), which alone made a viscosity stand out by
12 standard errors. And cells of its truth were 0.5 m long, up to 0.19 m wide: the truth itself was off by as much as
stood out on a perfect site (5.9). Both were mended before this edition, whose sets are all new. So what is better here
is in part the diagnosis, in part the truth. On the site taken apart, without errors of measurement, mending the
diagnosis was enough. Laws in no list are hidden in [a study of their own](discover_study.md); water that enters at a
place is not hidden at all. The records are in `data/blind`, and `make blind` goes on from them."""

PAGE = """# How often the diagnosis is right

Data were made in which something is hidden, and were diagnosed by a program that did not know it (`make blind`).
There are two kinds of truth. **The stranger's truth** is nearer to what a user has: it does not obey the equations of
the model to the letter, and its site is not quite what is told of it. **Own equations** is the easier test: the
equations of the model itself on a finer grid, in the small channel, on a perfect site. Its sets have errors and signs
of their own.

The stranger is an independent solver: explicit finite volumes (`tests/studies/second_solver.py`), its own grid, its
own waterline, and its own closures, coded from the same formulas. On a perfect site its formulas are those of the
model. On a site with imperfections they are drawn anew in each set:

- the floor of the bank law between 1.1 and 1.6 (1.3 in the model), and the rule for emergent plants;
- the logarithm above plants 0.85 to 1.15 times Baptist's, and a bed among them of 45 to 75 m^(1/2)/s (60 in the model);
- an eddy viscosity of 0.5 to 2.5 times the stated one;
- each side of each patch up to 0.1 m off, and 12 % of stems in each patch;
- a bed surveyed with an error of 1 cm, probes 2 cm beside their places, and discharges 1 % off.

Another law of plants altogether would be a missing effect, and no imperfection. Everything that the stranger hides is
hidden on such a site; sets with nothing hidden are made on both. The model is allowed errors (`model_error`) as
`vegglue import` writes them (friction 5 %, bed 1 cm), and of its site as whoever measured there may state them: edges
of patches 5 cm, probes 2 cm, discharges 1 %, stems 12 %. These were chosen after sets of this kind, with other seeds.
Without them the diagnosis names more that is not there. The eddy viscosity is calibrated, with a prior as `vegglue
import` writes it: stated to within a factor of two.

Where such an imperfection has a name in the list, a diagnosis may rightly say it, with its sign: the name counts as
true, though it is not what was hidden. No site has an imperfection of the kind that is hidden in it. Errors are new in
each set. Calibration starts where a user's does; true parameters lie 0.3 to 1 standard deviations off the middle of
their priors, at one of eight places, which is why sets are not quite as independent as the intervals suppose.

What is hidden is as large as makes it visible at the ratio stated: the length of its trace, after calibration has done
what it can, in standard errors of the data, the grid, and the model with its site as `model_error` allows. These last
are of about the size that the imperfections have.

A flow of the stranger is what explicit steps no longer change, where water is deeper than 0.15 m. Where cells at the
waterline fall dry and wet without end, it is the mean over 40 s or more.

The small channel has 93 stations in 32 m, with two patches (`configs/twin.yaml`). The field campaign has 270 stations
in 100 m, with seven patches (`configs/campaign.yaml`). Cells of the stranger are 0.25 x 0.125 m, those of the model
0.5 x 0.1875 m.

{sizes}

{left_out}

Not afforded: {afforded}

{lengths} Sets made since are sized in the stranger's own flow, see [below](#as-long-in-the-strangers-own-flow).

{limits}

{ideal}

## What came out

The intervals are binomial (Clopper and Pearson), 95 %. A line is met when its interval reaches what is wanted; of
fewer than 20 sets it is not said to be. Of {lines} lines with a figure, the share itself reaches it in {alone}, the
interval in {reached}, for the stranger's truth in all cases together:

{main}

Of the sets in which nothing is hidden, {unheard} of {nothing} were told that nothing is missing. The others that
were told no name were told "cannot tell": the model may err by more than 1.3 times the noise between the sections.

Names count where the verdict names: what it held when it ended with "cannot tell" is no name, but a set. A name is
false when it is among neither the hidden effects nor the imperfections of the site; a step is false when
all its rivals are, and the place that it tells first. A place is false over 1.5 m away from every hidden object. An
instrument is false when no hidden one shares a station with it. A hidden effect is in the set when a step has it among
its rivals, or, where nothing false is named, when it is listed as not excluded. Groups are those that the data cannot
tell apart, in the step that holds the hidden effect, else in what is not excluded if it is there, else in the first
step. A wrong name alone is the verdict of one effect, where no step is true.

Held-out errors are those at sections that were not measured, against the truth, with the error of a probe added. *Kept*
is what `vegglue extend --auto` keeps of what was found, by the same calibrations and the same choice: errors of
sections and experiments left out in turn have to fall. Its parent is the model calibrated without it. *All that was
named* is added without asking, which no command does. An instrument of one section, or a gauge, is perfect at the
sections that were not measured, both in the truth and in the model; what changes every probe alike acts there in both.
*The true effect itself* is put into the model, with its shapes known, and all is calibrated: even then the error
does not fall in every set, for the site is not quite what is told of it.
{kept}

![Shares and their intervals, both truths](blind-shares.svg)

![Held-out errors, before and after what extend --auto kept](blind-held-out.svg)

## Do the stated chances come true?

Each rival of a step is told with its chance. Counted are all rivals of first steps, where one listed effect is hidden
and nothing else.

{chances}

{distances}

Few names are some distance from their chance even where all chances are right. So the line is met when the distance is
no larger than chance makes it, 19 times of 20, where true shares lie as many points off as are wanted at most, to the
side that was seen. Rivals of one step count as if they were drawn apart, which they are not.

![Chances told and what came true](blind-chances.svg)

## What is named instead of what

Listed effects at ratio 6, the stranger's truth: what was named first where that is not true, at most 30 rows. In
{silent} such sets neither an effect nor a place was named.

{instead}

![Which effect was named first for each hidden one](blind-confusion.svg)

## As long in the stranger's own flow

Sets of the small channel in which what is hidden is as long as stated in the flow of the stranger, to 5 %, and not in
that of the model. They are among the sets above, too.

{sized}

## The field campaign alone

The stranger's truth.

{campaign}

## The small channel alone

The stranger's truth.

{twin}
"""

# What an observer would tell for whom the model is right; the figures for denser places were made once, by hand.
IDEAL = """\
A diagnosis knows neither, and all else may be missing as well. Let the model be right but for the object, and listed
effects, places of every term and size, and instruments compete to first order, by the rules of a diagnosis
(`tests/studies/object_limits.py`). Then none of these is told of {objects} such objects in {told} of draws of the
errors, and a place within 1.5 m in {near}. Who always names the circle of 1.5 m that most likely holds the object is
right in {guessed}. With places twice as dense, tried once, it is 72, 47 and 68 %. So 70 % within 1.5 m is at most what
always guessing gives, and out of reach for who has to be sure first. 85 % told is within reach only by telling it
wherever a place is likelier than not: {evenly}. Then it would be told of {evenly6} of listed effects of six standard
errors, and of {evenly3} of those of three, instead of {told6} and {told3} ({effects} sets). In the study it would add
at least 13 objects of 221 and one listed effect of ratio 3, by the chances that their sentences tell: it was not done.
The shares below come near these limits, on imperfect sites of another code: most of what is not told is not in the
data."""
